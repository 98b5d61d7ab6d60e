// SPDX-License-Identifier: MIT
#include "tools/paper/compare_runs.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/json_text.h"
#include "engine/core/quantile.h"
#include "engine/data/flip.h"
#include "engine/data/image_io.h"
#include "engine/data/metrics.h"
#include "engine/data/run_events.h"
#include "engine/reference/reference_render.h"
#include "engine/render/renderer.h"
#include "engine/report/html.h"
#include "engine/scene/splat_file.h"

namespace darb {

namespace {

double blended_splats(const SplatModel& model, const Camera& camera) {
    const reference::RenderResult result =
        reference::render(model, camera, reference::RenderSettings{});
    double sum = 0;
    for (const std::int32_t n : result.images.contributions.data) sum += n;
    return sum;
}

}  // namespace

BlendStatistics measure_blending(Device& device, const SplatModel& model,
                                 const std::vector<Camera>& cameras, int repeats) {
    DARB_CHECK(!cameras.empty() && repeats >= 1, "{} cameras, {} repeats", cameras.size(), repeats);
    ProjectionEffects effects;
    for (const Camera& camera : cameras) effects.lens |= camera.lens.active;
    Renderer renderer(device, model, {}, effects);
    BlendStatistics sum;
    double splats = 0, pixels = 0, intersections = 0, visible = 0;
    for (const Camera& camera : cameras) {
        renderer.render(camera);  // warm-up, and buffers of their size
        intersections += renderer.status().intersections;
        visible += renderer.status().visible;
        splats += blended_splats(model, camera);
        pixels += double(camera.width) * camera.height;
        std::vector<double> blend, frame;
        for (int r = 0; r < repeats; ++r) {
            renderer.render(camera);
            double of_blend = 0, of_frame = 0;
            for (const PassTime& pass : renderer.pass_times()) {
                of_frame += pass.ms;
                if (pass.name == "blend") of_blend += pass.ms;
            }
            blend.push_back(of_blend);
            frame.push_back(of_frame);
        }
        sum.blend_ms += median(blend);
        sum.frame_ms += median(frame);
    }
    const double count = static_cast<double>(cameras.size());
    sum.blended_per_pixel = splats / pixels;
    sum.intersections_per_splat = visible > 0 ? intersections / visible : 0;
    sum.ns_per_splat_pixel = splats > 0 ? 1e6 * sum.blend_ms / splats : 0;
    sum.blend_ms /= count;
    sum.frame_ms /= count;
    return sum;
}

// Reads output folders of training runs: their state and their figures.

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr const char* kOtherFolder = "Name another folder with -o, or remove this one.";

std::string differences(const Json& there, const Json& wanted) {
    std::string text;
    for (const auto& [name, value] : wanted.items())
        if (!there.contains(name) || there[name] != value)
            text +=
                fmt::format("{}{} is {}, wanted {}", text.empty() ? "" : "; ", name,
                            there.contains(name) ? there[name].dump() : "not set", value.dump());
    return text;
}

// JSON has null in place of NaN and infinity.
double number(const Json& record, const char* key) {
    const auto at = record.find(key);
    return at != record.end() && at->is_number() ? at->get<double>() : std::nan("");
}

ComparedAt evaluation_of(const Json& e, const fs::path& folder) {
    ComparedAt at;
    at.iteration = e.at("iteration");
    at.seconds = number(e, "seconds");
    at.psnr_db = number(e, "psnr_db");
    at.ssim = number(e, "ssim");
    at.splats = e.at("splats");
    if (const auto arc = e.find("arc"); arc != e.end()) at.arc_db = number(*arc, "psnr_db");
    const fs::path pictures = folder / "held_out" / std::to_string(at.iteration);
    std::set<std::string> used;  // in the order in which the run named its files
    for (const Json& v : e.at("views"))
        at.views.push_back({v.at("name"), number(v, "psnr_db"), number(v, "ssim"), std::nullopt,
                            pictures / picture_name(v.at("name"), used)});
    const fs::path model =
        folder / "point_cloud" / fmt::format("iteration_{}", at.iteration) / "point_cloud.ply";
    if (fs::exists(model)) {
        at.model = model;
        at.model_mb = 1e-6 * static_cast<double>(fs::file_size(model));
    }
    return at;
}

std::vector<CurvePoint> curve_of(const std::vector<Json>& events) {
    std::vector<CurvePoint> curve;
    for (const Json& e : events)
        if (e.value("event", "") == "iteration")
            curve.push_back({e.value("iteration", 0), number(e, "seconds"), number(e, "loss"),
                             e.value("splats", 0.0)});
    return curve;
}

void take_evaluation(const Json& e, const std::vector<int>& iterations, ComparedRun& run) {
    if (std::find(iterations.begin(), iterations.end(), e.at("iteration")) != iterations.end())
        run.at.push_back(evaluation_of(e, run.folder));
}

}  // namespace

RunState run_state(const fs::path& folder, const std::string& settings, const std::string& cameras,
                   int iterations, std::size_t held_out, const std::string& hold_out) {
    const fs::path metrics_path = folder / "metrics.json";
    if (fs::exists(metrics_path)) {
        const Json metrics = read_metrics(metrics_path);
        const Json start = metrics.value("start", Json::object());
        const Json there = start.value("settings", Json::object());
        if (const std::string other = differences(there, Json::parse(settings)); !other.empty())
            throw Error(metrics_path.string(), "is of a run with other settings: " + other,
                        kOtherFolder);
        const fs::path list = folder / "cameras.json";
        if (!fs::exists(list) || read_text_file(list) != cameras ||
            start.value("held_out_views", std::size_t{0}) != held_out ||
            start.value("hold_out", hold_out_text({})) != hold_out)
            throw Error(list.string(),
                        "the run there had other photos, another size or other held-out views",
                        kOtherFolder);
        if (!metrics.value("interrupted", true) && metrics.value("iteration", 0) == iterations)
            return RunState::finished;
    }
    return fs::exists(folder / "checkpoint.darb") ? RunState::partial : RunState::none;
}

void read_run(ComparedRun& run, const std::vector<int>& iterations) {
    const fs::path path = run.folder / "metrics.json";
    const Json metrics = read_metrics(path);
    try {
        for (const Json& e : metrics.at("evaluations")) take_evaluation(e, iterations, run);
        run.peak_mb = 1e-6 * metrics.at("peak_device_bytes").get<double>();
    } catch (const Json::exception& e) {
        throw Error(path.string(), json_reason(e), "Remove the folder to train again.");
    }
    run.curve = curve_of(read_events(run.folder / "run.jsonl"));
    for (const int iteration : iterations)
        if (std::none_of(run.at.begin(), run.at.end(),
                         [&](const ComparedAt& at) { return at.iteration == iteration; }))
            run.notes += fmt::format(
                "It was trained without an evaluation after {} iterations; remove {} to train it "
                "again. ",
                format_number(iteration), run.folder.string());
}

namespace {

void read_what_was_logged(ComparedRun& run, const std::vector<int>& iterations,
                          const std::string& settings, const std::string& cameras) {
    const fs::path log = run.folder / "run.jsonl", list = run.folder / "cameras.json";
    if (!fs::exists(log) || !fs::exists(list) || read_text_file(list) != cameras) return;
    const std::vector<Json> events = read_events(log);
    const auto start = std::find_if(events.rbegin(), events.rend(),
                                    [](const Json& e) { return e.value("event", "") == "start"; });
    if (start == events.rend() ||
        !differences(start->value("settings", Json::object()), Json::parse(settings)).empty())
        return;
    run.at.clear();
    for (const Json& e : events)
        if (e.value("event", "") == "evaluation") take_evaluation(e, iterations, run);
    run.curve = curve_of(events);
}

}  // namespace

void read_unfinished_run(ComparedRun& run, const std::vector<int>& iterations,
                         const std::string& settings, const std::string& cameras) {
    try {
        read_what_was_logged(run, iterations, settings, cameras);
    } catch (const std::exception& e) {  // the run has failed for a reason of its own
        run.notes += fmt::format("Its log cannot be read: {} ", e.what());
    }
}

HeldOutPicture read_held_out(const fs::path& picture) {
    const ImageU8 all = read_image(picture);
    const int width = all.width / 3;
    HeldOutPicture parts{ImageU8(width, all.height, 3), ImageU8(width, all.height, 3)};
    for (int y = 0; y < all.height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < 3; ++c) {
                parts.photo.at(x, y, c) = all.at(x, y, c);
                parts.render.at(x, y, c) = all.at(width + x, y, c);
            }
    return parts;
}

double ViewLpips::distance(const ComparedView& view, const HeldOutPicture& picture) {
    const LpipsFeatures render = lpips_->features(to_float(picture.render));
    if (const auto kept = photos_.find(view.name); kept != photos_.end())
        return lpips_->distance(render, kept->second);
    LpipsFeatures photo = lpips_->features(to_float(picture.photo));
    const double distance = lpips_->distance(render, photo);
    if (const std::size_t bytes = photo.bytes(); bytes <= room_) {
        room_ -= bytes;
        photos_.emplace(view.name, std::move(photo));
    }
    return distance;
}

void ViewLpips::measure(ComparedRun& run) {
    if (lpips_ == nullptr) return;
    for (ComparedAt& at : run.at) {
        double sum = 0;
        std::size_t measured = 0;
        for (ComparedView& view : at.views) {
            if (!std::filesystem::exists(view.picture)) continue;
            const HeldOutPicture p = read_held_out(view.picture);
            if (std::min(p.photo.width, p.photo.height) < lpips_->least_size()) continue;
            view.lpips = distance(view, p);
            sum += *view.lpips;
            ++measured;
        }
        if (measured > 0 && measured == at.views.size())
            at.lpips = sum / static_cast<double>(measured);
    }
}

void measure_flip(ComparedRun& run) {
    for (ComparedAt& at : run.at) {
        double sum = 0;
        std::size_t measured = 0;
        for (ComparedView& view : at.views) {
            if (!std::filesystem::exists(view.picture)) continue;
            const HeldOutPicture p = read_held_out(view.picture);
            view.flip = flip(to_float(p.render), to_float(p.photo));
            sum += *view.flip;
            ++measured;
        }
        if (measured > 0 && measured == at.views.size())
            at.flip = sum / static_cast<double>(measured);
    }
}

void count_exception(const std::exception& e, ComparedRun& run) {
    const bool user = dynamic_cast<const Error*>(&e) != nullptr ||
                      dynamic_cast<const std::filesystem::filesystem_error*>(&e) != nullptr;
    if (run.exit_code != 1) run.exit_code = user ? 2 : 1;
}

void attempt(ComparedRun& run, const std::string& what, const std::function<void()>& measurement) {
    try {
        measurement();
    } catch (const std::exception& e) {
        run.notes += "Without " + what + ": " + e.what() + " ";
        count_exception(e, run);
    }
}

void measure_blending_of(ComparedRun& run, Device& device, std::vector<Camera> cameras, int views) {
    if (run.at.empty() || run.at.back().model.empty()) return;
    cameras.resize(std::min(cameras.size(), static_cast<std::size_t>(views)));
    run.blending = measure_blending(device, load_splats(run.at.back().model), cameras);
}

}  // namespace darb
