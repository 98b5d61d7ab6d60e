// SPDX-License-Identifier: MIT
#include "tools/bench/yardstick.h"

#include <algorithm>
#include <cmath>

#include "engine/core/rng.h"
#include "engine/plan/accuracy.h"
#include "engine/raster/blend_backward.h"
#include "engine/raster/forward.h"
#include "engine/raster/frame_buffers.h"
#include "engine/raster/gpu_splats.h"
#include "tools/bench/native_blend.h"

namespace darb {

namespace {

constexpr int kMost = 20;  // samples

ForwardOptions options_of(const SplatModel& model, const ProjectionEffects& effects) {
    ForwardOptions options = frame_accuracy({}, model).options;
    options.effects = effects;
    options.effects.antialias = model.antialias;
    options.store_for_backward = true;
    return options;
}

double psnr(const std::vector<float>& a, const std::vector<float>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow(double(a[i]) - b[i], 2);
    return -10 * std::log10(std::max(sum / static_cast<double>(a.size()), 1e-20));
}

void add_error(const std::vector<float>& a, const std::vector<float>& b, double& error,
               double& norm) {
    for (std::size_t i = 0; i < a.size(); ++i) {
        error += std::pow(double(a[i]) - b[i], 2);
        norm += std::pow(double(b[i]), 2);
    }
}

// One camera: its frame on the device, and the same computed natively. The backward blend is
// that of Backward, without the passes after it.
class Side {
  public:
    Side(Device& device, const SplatModel& model, const Camera& camera,
         const ProjectionEffects& effects)
        : splats_(device, model, false),
          buffers_(device, options_of(model, effects)),
          forward_(device, options_of(model, effects)),
          backward_(device, forward_.options()),
          commands_(device),
          view_{camera_data(camera, splats_.origin()), nullptr, 0, model.sh_degree},
          cameras_(upload_cameras(device, {view_.camera})) {
        view_.cameras = &cameras_;
        const std::size_t floats = std::size_t{view_.camera.width} * view_.camera.height * 3;
        Pcg32 random(7, 1);
        for (std::size_t i = 0; i < floats; ++i)
            d_image_.push_back(static_cast<float>(random.uniform(-1, 1)));
        d_image_on_device_ = Buffer(device, "d_image", floats * 4);
        d_image_on_device_.upload(d_image_);
        buffers_.reserve(splats_.count(), splats_.count() * 4, camera.width, camera.height);
        do {
            commands_.begin();
            record_forward();
            commands_.submit_and_wait();
            status_ = buffers_.frame().read_status();
        } while (buffers_.make_room(status_));
        backward_.reserve(buffers_.size().intersections);
        draw();
        if (forward_.options().kernel == KERNEL_GAUSSIAN)
            frame_ = download_frame(forward_.options(), buffers_.frame(), view_, splats_.count(),
                                    status_.intersections);
    }

    /// Milliseconds of the passes "blend" and "blend backward".
    std::pair<double, double> draw() {
        commands_.begin();
        record_forward();
        commands_.pass("blend backward");
        backward_.record(commands_, view_, buffers_.frame(), d_image_on_device_);
        commands_.submit_and_wait();
        std::pair<double, double> ms;
        for (const PassTime& pass : commands_.pass_times()) {
            if (pass.name == "blend") ms.first += pass.ms;
            if (pass.name == "blend backward") ms.second += pass.ms;
        }
        return ms;
    }

    std::pair<double, double> draw_natively(int threads = 0) {
        const double forward = milliseconds([&] { native_blend(frame_, image_, threads); });
        return {forward, milliseconds([&] {
                    native_blend_backward(frame_, image_, d_image_, partials_, threads);
                })};
    }

    double picture_psnr() const {
        return psnr(image_.image,
                    buffers_.frame().images.image.download<float>(image_.image.size()));
    }
    double sums_error() const {
        double error = 0, norm = 0;
        add_error(partials_.first, backward_.partials().download<float>(partials_.first.size()),
                  error, norm);
        add_error(partials_.rest, backward_.rest().download<float>(partials_.rest.size()), error,
                  norm);
        return std::sqrt(error / std::max(norm, 1e-300));
    }

    const BlendFrame& frame() const { return frame_; }
    const gpu::FrameStatus& status() const { return status_; }

  private:
    void record_forward() { forward_.record(commands_, splats_, view_, buffers_.frame()); }

    GpuSplats splats_;
    FrameBuffers buffers_;
    Forward forward_;
    BlendBackward backward_;
    Commands commands_;
    FrameView view_;
    Buffer cameras_, d_image_on_device_;
    gpu::FrameStatus status_{};
    std::vector<float> d_image_;
    BlendFrame frame_;
    BlendedImage image_;
    BlendPartials partials_;
};

std::vector<Yardstick> yardsticks(const std::vector<double> (&ms)[4], double picture_psnr,
                                  double sums_error) {
    return {{"blend", spread_of(ms[0]), spread_of(ms[2]), "psnr_db", picture_psnr},
            {"blend backward", spread_of(ms[1]), spread_of(ms[3]), "relative_error", sums_error}};
}

}  // namespace

BlendFigures measure_blend(Device& device, const SplatModel& model,
                           const std::vector<Camera>& cameras, const ProjectionEffects& effects,
                           const Sampling& sampling) {
    BlendFigures figures;
    const double share = 1.0 / static_cast<double>(cameras.size());
    std::vector<double> mean_ms[4];  // device forward, backward; native forward, backward
    double worst_psnr = 1e9, worst_error = 0;
    for (const Camera& camera : cameras) {
        Side side(device, model, camera, effects);
        figures.counts.visible += share * side.status().visible;
        figures.counts.intersections += share * side.status().intersections;
        figures.counts.pixels += share * camera.width * camera.height;
        if (side.frame().width == 0) continue;  // a kernel without native loops
        const BlendCounts counts = count_blend(side.frame());
        figures.counts.evaluated += share * static_cast<double>(counts.evaluated);
        figures.contributing += share * static_cast<double>(counts.contributing);
        side.draw_natively();
        worst_psnr = std::min(worst_psnr, side.picture_psnr());
        worst_error = std::max(worst_error, side.sums_error());
        const std::size_t wanted = static_cast<std::size_t>(std::clamp(sampling.least, 1, kMost));
        for (std::size_t taken = 0; taken < wanted; ++taken) {
            const auto device_ms = side.draw();
            const auto native_ms = side.draw_natively();
            const double one[4] = {device_ms.first, device_ms.second, native_ms.first,
                                   native_ms.second};
            for (int i = 0; i < 4; ++i) {
                if (mean_ms[i].size() <= taken) mean_ms[i].push_back(0);
                mean_ms[i][taken] += share * one[i];
            }
        }
    }
    figures.counts.splats = static_cast<double>(model.size());
    figures.counts.rest_floats = model.rest_count();
    if (!mean_ms[0].empty()) figures.yardsticks = yardsticks(mean_ms, worst_psnr, worst_error);
    return figures;
}

std::vector<Yardstick> compare_blend(Device& device, const SplatModel& model, const Camera& camera,
                                     int threads) {
    Side side(device, model, camera, {});
    std::vector<double> ms[4] = {{0}, {0}, {0}, {0}};
    side.draw_natively(threads);
    return yardsticks(ms, side.picture_psnr(), side.sums_error());
}

}  // namespace darb
