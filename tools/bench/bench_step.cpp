// SPDX-License-Identifier: MIT
#include "tools/bench/bench_step.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "engine/core/rng.h"
#include "engine/core/say.h"
#include "engine/plan/roofline.h"
#include "engine/plan/tuner.h"
#include "engine/render/renderer.h"
#include "tools/bench/cases.h"
#include "trainer/growth/density_control.h"
#include "trainer/growth/density_strategy.h"
#include "trainer/options/schedule.h"
#include "trainer/step/exposure.h"
#include "trainer/step/optimizer.h"
#include "trainer/step/photos.h"
#include "trainer/step/smoothing.h"

namespace darb {

namespace {

ForwardOptions training_options() {
    ForwardOptions options;
    options.store_for_backward = true;
    return options;
}

// Rates at which the scene looks unchanged, whatever the number of samples.
AdamStep small_step() {
    AdamStep rates;
    rates.rate.fill(1e-7f);
    rates.clearance = 0.1f;
    return adam_step(rates, 1000);
}

std::uint64_t pixels_of(const Camera& camera) {
    return std::uint64_t(camera.width) * std::uint64_t(camera.height);
}

}  // namespace

BenchStep::BenchStep(Device& device, const SplatModel& model, const Camera& camera)
    : sh_degree_(model.sh_degree),
      buffers_(device, training_options()),
      forward_(device, training_options()),
      backward_(device, training_options()),
      loss_(device, camera.width, camera.height),
      update_(device),
      commands_(device),
      fused_(device, model, true),
      apart_(device, model, true),
      gradients_(device, apart_),
      view_{camera_data(camera, model.origin), &cameras_, 0, sh_degree_, glm::vec3(0)},
      cameras_(upload_cameras(device, {view_.camera})),
      photo_(device, "photo", pixels_of(camera) * 4),
      d_image_(device, "d_image", pixels_of(camera) * 12),
      result_(device, "loss", sizeof(gpu::LossResult)) {
    Pcg32 random(5, 6);
    std::vector<std::uint32_t> photo(pixels_of(camera));
    for (std::uint32_t& pixel : photo) pixel = random.next() | 0xFF000000u;
    photo_.upload(photo);
    buffers_.reserve(fused_.count(), fused_.count() * 4, camera.width, camera.height);
    for (const bool apart : {false, true}) run(apart);  // buffers grow
}

std::vector<PassTime> BenchStep::run(bool apart) {
    GpuSplats& splats = apart ? apart_ : fused_;
    Frame& frame = buffers_.frame();
    do {
        backward_.reserve(splats.count(), frame.size.intersections, frame.checkpoint_records());
        commands_.begin();
        forward_.record(commands_, splats, view_, frame);
        loss_.record(commands_, {frame.images.image, photo_, d_image_, result_},
                     static_cast<int>(view_.camera.width), static_cast<int>(view_.camera.height),
                     view_.background);
        apart ? record_apart(splats)
              : backward_.record(commands_, view_, frame, splats, d_image_, small_step());
        commands_.submit_and_wait();
        status_ = frame.read_status();
    } while (buffers_.make_room(status_));
    return commands_.pass_times();
}

void BenchStep::record_apart(GpuSplats& splats) {
    const Frame& frame = buffers_.frame();
    const Buffer& status = frame.counters.status;
    backward_.record_gradients(commands_, view_, frame, splats, d_image_, {gradients_});
    update_.record(commands_, splats, gradients_, status, sh_degree_, small_step());
    update_.record_fading(commands_, splats, gradients_, status, view_, small_step().clearance);
    update_.record_sums(commands_, gradients_, status, backward_.gradient_sum());
}

namespace {

using Json = nlohmann::json;

// Buffers are really allocated for kSplats, so these are few; the counts of an iteration are those
// for kNamedSplats.
constexpr std::size_t kSplats = 20'000;
constexpr int kDegree = 3, kSide = 256;
constexpr double kNamedSplats = 1e6, kNamedPixels = 1e6, kIntersectionsOfASplat = 6;

enum class FrameDepth { without, with };

void compile_frame(Device& device, const ForwardOptions& options, FrameDepth depth) {
    const Camera camera = bench_camera(glm::dvec3(0, 0, 4), true, kSide, kSide);
    FrameBuffers buffers(device, options);
    Forward forward(device, options);
    const SplatModel model = random_scene(64, kDegree);
    GpuSplats splats(device, model, false);
    const Buffer cameras = upload_cameras(device, {camera_data(camera, model.origin)});
    const FrameView view{camera_data(camera, model.origin), &cameras, 0, kDegree, glm::vec3(0)};
    buffers.reserve(splats.count(), splats.count() * 4, kSide, kSide);
    Commands commands(device);
    commands.begin();
    forward.record(commands, splats, view, buffers.frame());
    if (depth == FrameDepth::with)
        forward.record_depth(commands, splats.count(), view, buffers.frame());
    commands.submit_and_wait();
}

// Frames at every degree that training passes through, with room for huge splats, long lists and
// depth.
void compile_frames(Device& device) {
    const Camera camera = bench_camera(glm::dvec3(0, 0, 4), true, kSide, kSide);
    for (int degree = 0; degree < kDegree; ++degree)
        BenchStep(device, random_scene(64, degree), camera);
    ForwardOptions options;
    options.huge_splat_path = HugeSplatPath::always;
    compile_frame(device, options, FrameDepth::with);
    const Upsample upsample(device);
}

// The blends of fast16, where the device can have them.
void compile_half(Device& device) {
    if (!device.info().half_arithmetic ||
        lanes_by_pixels(device.info(), blend_subgroup(device)) == 0)
        return;
    ForwardOptions options;
    options.store_for_backward = true;
    options.arithmetic = ARITHMETIC_FAST16;
    compile_frame(device, options, FrameDepth::without);
    const BlendBackward backward(device, options);
}

void compile_training(Device& device) {
    const Schedule schedule;
    for (const Strategy strategy : all_strategies())
        strategy_row(strategy).make({device, schedule, 1.0});
    const DensityControl control(device, schedule.options.kernel);
    const MortonOrder order(device);
    const Exposure exposure(device, {2}, kSide * kSide), tones(device, {2, true}, kSide * kSide);
    const IterateAverage average(device);
    const ResolutionRamp ramp(device);
    ProjectionEffects effects;
    effects.smoothing = true;
    const SmoothingFilter smoothing(device, effects);
}

std::vector<RecordedWork> iteration_of(const BenchStep& step) {
    FrameCounts counts;
    counts.splats = counts.visible = kNamedSplats;
    counts.intersections = kIntersectionsOfASplat * kNamedSplats;
    counts.pixels = kNamedPixels;
    counts.rest_floats = attribute_floats(kShRest, kDegree);
    std::vector<RecordedWork> rows;
    for (const RecordedPass& pass : step.recorded()) {
        const std::optional<PassWork> work = pass_work(pass.name, counts);
        rows.push_back({pass, work ? work->bytes : 0});
    }
    return rows;
}

std::string amount(const std::optional<double>& value) {
    return value ? fmt::format("{:.0f}", *value) : "-";
}

}  // namespace

PassStatistics compile_every_pass(const std::string& select) {
    DeviceOptions options;
    options.select = select;
    options.compile_only = true;
    Device device(options);
    PassStatistics all;
    all.device = device.info();
    all.has_statistics = device.has_pipeline_statistics();
    all.splats = kNamedSplats, all.pixels = kNamedPixels;
    all.intersections = kIntersectionsOfASplat * kNamedSplats;
    const Tuning usual = device.tuning();
    const SplatModel model = random_scene(kSplats, kDegree);
    const Camera camera = bench_camera(glm::dvec3(0, 0, 4), true, kSide, kSide);
    {
        BenchStep step(device, model, camera);
        step.run(false);
        all.iteration = iteration_of(step);
    }
    for (const TuningGroup& group : tuning_groups(device.info()))
        for (const std::string& choice : group.choices) {
            device.set_tuning(with_names(usual, {{group.name, choice}}));
            if (device.tuning() == usual) continue;
            const BenchStep step(device, model, camera);
        }
    device.set_tuning(usual);
    compile_frames(device);
    compile_half(device);
    compile_training(device);
    std::set<std::string> seen;
    for (const CompiledPipeline& one : device.compiled())
        if (seen.insert(fmt::format("{} {} {} {}", one.shader, one.constants, one.threads,
                                    one.subgroup_size))
                .second)
            all.compiled.push_back(one);
    return all;
}

void print_pass_statistics(std::FILE* out, const PassStatistics& all) {
    tell(out, "{} ({})\n", all.device.name, all.device.driver);
    if (!all.has_statistics)
        tell(out,
             "This driver has no statistics of pipelines "
             "(VK_KHR_pipeline_executable_properties): times of compilation alone.\n");
    tell(out, "\n{:<26}{:>8}{:>9}{:>10}{:>8}{:>9}{:>8}{:>10}{:>9}{:>9}{:>9}  {}\n", "pass",
         "threads", "subgroup", "registers", "spills", "scratch", "shared", "occupancy", "instr.",
         "cycles", "ms", "constants");
    for (const CompiledPipeline& one : all.compiled) {
        const CommonStatistics c = common_statistics(one);
        tell(out, "{:<26}{:>8}{:>9}{:>10}{:>8}{:>9}{:>8}{:>10}{:>9}{:>9}{:>9.1f}  {}\n", one.shader,
             one.threads, one.subgroup_size != 0 ? fmt::format("{}", one.subgroup_size) : "-",
             amount(c.registers), amount(c.spills), amount(c.scratch_bytes), amount(c.shared_bytes),
             amount(c.occupancy), amount(c.instructions), amount(c.cycles), one.compile_ms,
             one.constants);
    }
    tell(out,
         "\nOne iteration, {:.0f} visible splats of degree {}, {:.0f} pixels, {:.0f} "
         "intersections:\n{:<26}{:>11}{:>10}{:>13}{:>10}\n",
         all.splats, kDegree, all.pixels, all.intersections, "pass", "dispatches", "barriers",
         "descriptors", "MiB");
    RecordedPass sum;
    double bytes = 0;
    for (const RecordedWork& row : all.iteration) {
        tell(out, "{:<26}{:>11}{:>10}{:>13}{:>10}\n", row.pass.name, row.pass.dispatches,
             row.pass.barriers, row.pass.descriptors,
             row.bytes > 0 ? fmt::format("{:.0f}", row.bytes / (1 << 20)) : "-");
        sum.dispatches += row.pass.dispatches;
        sum.barriers += row.pass.barriers;
        sum.descriptors += row.pass.descriptors;
        bytes += row.bytes;
    }
    tell(out, "{:<26}{:>11}{:>10}{:>13}{:>10.0f}\n", "all", sum.dispatches, sum.barriers,
         sum.descriptors, bytes / (1 << 20));
}

nlohmann::json pass_statistics_json(const PassStatistics& all) {
    Json json{{"device", all.device.name},
              {"driver", all.device.driver},
              {"has_statistics", all.has_statistics},
              {"passes", Json::array()}};
    const auto put = [](Json& to, const char* name, const std::optional<double>& value) {
        if (value) to[name] = *value;
    };
    for (const CompiledPipeline& one : all.compiled) {
        const CommonStatistics c = common_statistics(one);
        Json row{{"shader", one.shader},         {"constants", one.constants},
                 {"threads", one.threads},       {"subgroup_size", one.subgroup_size},
                 {"compile_ms", one.compile_ms}, {"driver_says", Json::object()}};
        put(row, "registers", c.registers);
        put(row, "spills", c.spills);
        put(row, "scratch_bytes", c.scratch_bytes);
        put(row, "shared_bytes", c.shared_bytes);
        put(row, "occupancy", c.occupancy);
        put(row, "instructions", c.instructions);
        put(row, "cycles", c.cycles);
        for (const PipelineStatistic& value : one.values)
            row["driver_says"][value.name] = value.value;
        json["passes"].push_back(std::move(row));
    }
    json["iteration"] = {{"splats", all.splats},
                         {"pixels", all.pixels},
                         {"intersections", all.intersections},
                         {"passes", Json::array()}};
    for (const RecordedWork& row : all.iteration)
        json["iteration"]["passes"].push_back({{"pass", row.pass.name},
                                               {"dispatches", row.pass.dispatches},
                                               {"barriers", row.pass.barriers},
                                               {"descriptors", row.pass.descriptors},
                                               {"bytes", row.bytes}});
    return json;
}

}  // namespace darb
