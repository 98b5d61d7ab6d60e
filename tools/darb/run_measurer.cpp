#include "tools/darb/run_measurer.h"

#include <fmt/format.h>

#include <set>

#include "engine/core/say.h"
#include "engine/gpu/device_environment.h"
#include "engine/plan/tuner.h"
#include "engine/scene/splat_file.h"
#include "tools/darb/evaluation_flags.h"
#include "tools/darb/outputs.h"
#include "tools/paper/compare_stats.h"

namespace darb {

void say_what_went_wrong(const ComparedRun& run) {
    if (run.exit_code != 0 && !run.failure.empty()) say("failed: {}\n", run.failure);
    if (!run.notes.empty()) say_note("note: " + run.notes);
}

RunMeasurer::RunMeasurer(const CompareFlags& flags, const std::filesystem::path& path,
                         const Dataset& dataset, const TrainRequest& first, const Lpips* lpips)
    : flags_(flags),
      lpips_(lpips),
      off_path_(off_path_of(path, dataset.options)),
      lpips_name_(lpips ? lpips->net_name() : "none") {
    for (const double scale : flags.scales)
        scaled_.push_back(scaled_views(held_out_views(dataset.views), scale));
    options_.background = glm::vec3(first.train.white_background ? 1.0f : 0.0f);
    options_.effects = parse_effects(first.effects);  // as it trains, so it is measured
    options_.alpha_is_mask = dataset.alpha_is_mask;
}

void RunMeasurer::measure_models(ComparedRun& run, Device& device) const {
    for (ComparedAt& at : run.at) {
        if (at.model.empty()) continue;
        const SplatModel model = load_splats(at.model);
        for (std::size_t i = 0; i < scaled_.size(); ++i) {
            const Evaluation e = evaluate_scene(device, model, scaled_[i], options_);
            at.scales.push_back({flags_.scales[i], e.psnr_db, e.ssim});
        }
        if (off_path_.views.empty()) continue;
        SceneEvaluation options = options_;
        options.alpha_is_mask = off_path_.alpha_is_mask;
        at.off_path_db =
            evaluate_scene(device, model, held_out_views(off_path_.views), options).psnr_db;
    }
}

void RunMeasurer::on_device(ComparedRun& run, const char* what,
                            const std::function<void(Device&)>& measurement) const {
    attempt(run, what, [&] {
        DeviceOptions options = command_device(flags_.device);
        Device device(options);
        settle_tuning(device);
        measurement(device);
    });
}

void RunMeasurer::measure(ComparedRun& run) {
    attempt(run, "LPIPS", [&] { lpips_.measure(run); });
    attempt(run, "learned shapes", [&] { read_shapes_of(run); });
    if (!scaled_.empty() || !off_path_.views.empty())
        on_device(run, "other sizes and views off the path",
                  [&](Device& device) { measure_models(run, device); });
}

void RunMeasurer::measure_blending(std::vector<ComparedRun>& runs,
                                   const std::vector<View>& held_out) const {
    if (flags_.blending_views == 0) return;
    std::vector<Camera> cameras;
    for (const View& view : held_out) cameras.push_back(view.camera);
    std::set<std::string> done;  // kernels
    for (ComparedRun& run : runs) {
        if (!run.failure.empty() || done.contains(run.kernel)) continue;
        const std::string before = run.notes;
        on_device(run, "blending", [&](Device& device) {
            measure_blending_of(run, device, cameras, flags_.blending_views);
            done.insert(run.kernel);
        });
        if (run.notes != before) say_note("note: " + run.notes.substr(before.size()));
    }
}

std::string RunMeasurer::measurements() const {
    std::string text =
        fmt::format("LPIPS {}, {} views off the path, sizes", lpips_name_, off_path_.views.size());
    for (const double scale : flags_.scales) text += fmt::format(" {}", scale);
    return text;
}

}  // namespace darb
