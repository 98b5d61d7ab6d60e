#include "tools/bench/pass_statistics.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "engine/core/say.h"
#include "engine/plan/roofline.h"
#include "engine/plan/tuning_names.h"
#include "engine/render/upsample.h"
#include "tools/bench/bench_step.h"
#include "tools/bench/scenes.h"
#include "trainer/growth/density_strategy.h"
#include "trainer/growth/morton_order.h"
#include "trainer/options/schedule.h"
#include "trainer/step/exposure.h"
#include "trainer/step/iterate_average.h"
#include "trainer/step/photos.h"
#include "trainer/step/smoothing.h"

namespace darb {

namespace {

using Json = nlohmann::json;

// Buffers are made for them, so they are few; the counts of an iteration are for the ones named.
constexpr std::size_t kSplats = 20'000;
constexpr int kDegree = 3, kSide = 256;
constexpr double kNamedSplats = 1e6, kNamedPixels = 1e6, kIntersectionsOfASplat = 6;

// Frames of every degree that training comes by, with room for huge splats, long lists and depth.
void compile_frames(Device& device) {
    const Camera camera = bench_camera(glm::dvec3(0, 0, 4), true, kSide, kSide);
    for (int degree = 0; degree < kDegree; ++degree)
        BenchStep(device, random_scene(64, degree), camera);
    ForwardOptions options;
    options.huge_splat_path = HugeSplatPath::always;
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
    forward.record_depth(commands, splats.count(), view, buffers.frame());
    commands.submit_and_wait();
    const Upsample upsample(device);
}

void compile_training(Device& device) {
    TrainOptions options;
    const Schedule schedule(options);
    for (const Strategy strategy : all_strategies())
        strategy_row(strategy).make({device, options, schedule, 1.0});
    const DensityControl control(device, options.kernel);
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
