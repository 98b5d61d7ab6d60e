#include <fmt/format.h>

#include <glm/glm.hpp>

#include "tools/bench/bench_step.h"
#include "tools/bench/cases.h"
#include "tools/bench/scenes.h"

namespace darb {

namespace {

constexpr std::size_t kStepSplats = 100'000;
constexpr int kStepDegree = 3;

// A sample is a step in each way, one after the other; the case's time is that of both.
BenchResult measure(Device& device, int width, int height, const BenchOptions& options) {
    const Camera camera = bench_camera(glm::dvec3(0, 0, 4), true, width, height);
    BenchStep frame(device, random_scene(kStepSplats, kStepDegree), camera);
    BenchResult result;
    take_samples(
        options.sampling, 1,
        [&] {
            std::vector<PassTime> passes;
            for (const bool apart : {false, true}) {
                const std::string way = apart ? "apart" : "fused";
                double sum = 0;
                for (const PassTime& pass : frame.run(apart)) {
                    sum += pass.ms;
                    if (pass.name == "project backward" || pass.name == "adam")
                        passes.push_back({pass.name + ", " + way, pass.ms});
                }
                passes.push_back({"step, " + way, sum});
            }
            return passes;
        },
        result);
    result.counts.splats = kStepSplats;
    result.counts.visible = frame.status().visible;
    result.counts.intersections = frame.status().intersections;
    result.counts.pixels = double(width) * height;
    result.counts.rest_floats = attribute_floats(kShRest, kStepDegree);
    double fused = 0, apart = 0;
    for (const PassFigure& pass : result.passes) {
        if (pass.name == "step, fused") fused = pass.ms.median;
        if (pass.name == "step, apart") apart = pass.ms.median;
    }
    result.note = fmt::format("gradients and optimiser apart take {:+.1f} % of a step",
                              fused > 0 ? 100 * (apart / fused - 1) : 0.0);
    return result;
}

}  // namespace

std::vector<BenchCase> step_cases() {
    std::vector<BenchCase> cases;
    for (const glm::ivec2 size : {glm::ivec2(320, 240), glm::ivec2(800, 600)})
        cases.push_back({fmt::format("step/random_100k/{}x{}", size.x, size.y), "",
                         [size](Device& device, const DeviceRates&, const BenchOptions& options) {
                             return measure(device, size.x, size.y, options);
                         }});
    return cases;
}

}  // namespace darb
