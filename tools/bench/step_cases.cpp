#include <fmt/format.h>

#include <glm/glm.hpp>

#include "engine/core/rng.h"
#include "engine/raster/adam_update.h"
#include "engine/raster/backward.h"
#include "engine/raster/forward.h"
#include "engine/raster/frame_buffers.h"
#include "engine/raster/loss.h"
#include "tools/bench/cases.h"
#include "tools/bench/scenes.h"

namespace darb {

namespace {

constexpr std::size_t kSplats = 100'000;
constexpr int kDegree = 3;

// One step of training on a random scene and a photo of noise, in both ways: Adam within the
// backward pass, or gradients in buffers and a pass of its own. Each has splats of its own.
class BenchStep {
  public:
    BenchStep(Device& device, const SplatModel& model, const Camera& camera)
        : buffers_(device, training_options()),
          forward_(device, training_options()),
          backward_(device, training_options()),
          loss_(device, camera.width, camera.height),
          update_(device),
          commands_(device),
          fused_(device, model, true),
          apart_(device, model, true),
          gradients_(device, apart_),
          view_{camera_data(camera, model.origin), &cameras_, 0, kDegree, glm::vec3(0)},
          cameras_(upload_cameras(device, {view_.camera})),
          photo_(device, "photo", pixels() * 4),
          d_image_(device, "d_image", pixels() * 12),
          result_(device, "loss", sizeof(gpu::LossResult)) {
        Pcg32 random(5, 6);
        std::vector<std::uint32_t> photo(pixels());
        for (std::uint32_t& pixel : photo) pixel = random.next() | 0xFF000000u;
        photo_.upload(photo);
        buffers_.reserve(fused_.count(), fused_.count() * 4, camera.width, camera.height);
        for (const bool apart : {false, true}) run(apart);  // buffers grow
    }

    /// The passes of one step.
    std::vector<PassTime> run(bool apart) {
        GpuSplats& splats = apart ? apart_ : fused_;
        Frame& frame = buffers_.frame();
        do {
            backward_.reserve(splats.count(), frame.size.intersections, frame.checkpoint_records());
            commands_.begin();
            forward_.record(commands_, splats, view_, frame);
            loss_.record(commands_, {frame.images.image, photo_, d_image_, result_},
                         static_cast<int>(view_.camera.width),
                         static_cast<int>(view_.camera.height), view_.background);
            apart ? record_apart(splats)
                  : backward_.record(commands_, view_, frame, splats, d_image_, step());
            commands_.submit_and_wait();
            status_ = frame.read_status();
        } while (buffers_.make_room(status_));
        return commands_.pass_times();
    }
    const gpu::FrameStatus& status() const { return status_; }

  private:
    static ForwardOptions training_options() {
        ForwardOptions options;
        options.store_for_backward = true;
        return options;
    }
    std::uint64_t pixels() const { return std::uint64_t{view_.camera.width} * view_.camera.height; }
    // Rates that leave the scene as it is to the eye, whatever the number of samples.
    static AdamStep step() {
        AdamStep rates;
        rates.rate.fill(1e-7f);
        rates.clearance = 0.1f;
        return adam_step(rates, 1000);
    }
    void record_apart(GpuSplats& splats) {
        const Frame& frame = buffers_.frame();
        const Buffer& status = frame.counters.status;
        backward_.record_gradients(commands_, view_, frame, splats, d_image_, gradients_, false);
        update_.record(commands_, splats, gradients_, status, kDegree, step());
        update_.record_fading(commands_, splats, gradients_, status, view_, step().clearance);
        update_.record_sums(commands_, gradients_, status, backward_.gradient_sum());
    }

    FrameBuffers buffers_;
    Forward forward_;
    Backward backward_;
    Loss loss_;
    AdamUpdate update_;
    Commands commands_;
    GpuSplats fused_, apart_;
    GradientBuffers gradients_;
    FrameView view_;
    Buffer cameras_, photo_, d_image_, result_;
    gpu::FrameStatus status_{};
};

// A sample is a step in each way, one after the other; the case's time is that of both.
BenchResult measure(Device& device, int width, int height, const BenchOptions& options) {
    const Camera camera = bench_camera(glm::dvec3(0, 0, 4), true, width, height);
    BenchStep frame(device, random_scene(kSplats, kDegree), camera);
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
    result.counts.splats = kSplats;
    result.counts.visible = frame.status().visible;
    result.counts.intersections = frame.status().intersections;
    result.counts.pixels = double(width) * height;
    result.counts.rest_floats = attribute_floats(kShRest, kDegree);
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
