// SPDX-License-Identifier: MIT
// Renderer: one model on one device, and pictures of it from any camera, at a chosen accuracy.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "engine/core/image.h"
#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/plan/accuracy.h"
#include "engine/raster/forward.h"
#include "engine/raster/frame_buffers.h"
#include "engine/raster/median_depth.h"
#include "engine/scene/camera.h"
#include "shaders/shared/render_args.h"

namespace darb {

class FrameExchange {
  public:
    explicit FrameExchange(Device& device);

    /// Records the start of a frame; no earlier frame may still run. The camera goes to cameras(),
    /// at index 0.
    void send(Commands& commands, const gpu::CameraData& camera);
    const Buffer& cameras() const { return cameras_; }

    /// Records the end of a frame: fetches its gpu::FrameStatus, which status() returns after the
    /// frame has finished.
    void fetch(Commands& commands, const Buffer& status);
    gpu::FrameStatus status() const;

  private:
    Buffer cameras_, camera_host_, status_host_;
};

// Upsample: interpolates a picture rendered at half the size to the size that is shown.

/// The same view at another size.
Camera resized(const Camera& camera, int width, int height);
/// The view with half the pixels each way, rounded up.
Camera halved(const Camera& camera);

class Upsample {
  public:
    explicit Upsample(Device& device);
    /// Records the pass. image: float [3][H][W] at the size of `rendered`. Returns one at the
    /// size of `shown`, valid until the next call.
    const Buffer& record(Commands& commands, const Buffer& image, const Camera& rendered,
                         const Camera& shown);

  private:
    Device* device_;
    Pipeline pipeline_;
    Buffer image_;
};

class Renderer {
  public:
    /// Uploads the model, which determines effects.antialias. Cameras with a lens need
    /// effects.lens.
    Renderer(Device& device, const SplatModel& model, const Accuracy& accuracy = {},
             const ProjectionEffects& effects = {},
             HugeSplatPath huge_splat_path = HugeSplatPath::by_counters);
    /// Takes the options as they are, except for kernel, footprint and effects.antialias, which
    /// come from the model.
    Renderer(Device& device, const SplatModel& model, const ForwardOptions& options);

    /// Renders RGB, not clamped. sh_degree -1: all that the accuracy allows. Grows its buffers and
    /// repeats the frame where there are more splat-tile intersections than before.
    ImageF render(const Camera& camera, const glm::vec3& background = glm::vec3(0.0f),
                  int sh_degree = -1, float near_plane = static_cast<float>(NEAR_DEFAULT));
    /// Renders without copying the picture to the host, for measurements: float [3][H][W] on the
    /// device, which the next frame overwrites.
    const Buffer& draw(const Camera& camera, const glm::vec3& background = glm::vec3(0.0f),
                       int sh_degree = -1, float near_plane = static_cast<float>(NEAR_DEFAULT));

    /// Finds which splats a camera's pixels show, and in which order, without their picture: all
    /// that light_at() and render_depth(reading) need.
    void list(const Camera& camera, float near_plane = static_cast<float>(NEAR_DEFAULT));

    /// [H][W][2] for the camera of the last render, which must have taken place: the expected depth
    /// sum w z / sum w along the optical axis, world units, and sum w, the opacity of the pixel.
    /// Depth is 0 where nothing is seen (opacity below 1/255).
    ImageF render_depth();
    /// [H][W][2] for the camera of the last render, which must have taken place: the depth along
    /// the optical axis, world units, at which the share `level` of the light is left, and the
    /// opacity of the pixel. Depth is 0 where more is left behind all splats. `expected` is
    /// render_depth(), without a level. Throws Error where the kernel has no such reading.
    ImageF render_depth(DepthReading reading, float level = 0.5f);

    /// The share of the light that is left at each point of the space of the last camera that was
    /// rendered or listed; the points must be in its picture. `expected` is no reading of this.
    std::vector<float> light_at(std::span<const ViewPoint> points, DepthReading reading);

    /// The status of the last render.
    gpu::FrameStatus status() const { return status_; }
    const std::vector<PassTime>& pass_times() const { return pass_times_; }

  private:
    Renderer(Device& device, const SplatModel& model, const FrameAccuracy& accuracy);
    /// Records and submits what a frame needs, again with more room where there was too little.
    void run_frame(const Camera& rendered, const glm::vec3& background, int degree,
                   float near_plane, const std::function<void(Frame&)>& record);

    Device* device_;
    FrameAccuracy accuracy_;
    GpuSplats splats_;
    FrameBuffers buffers_;
    Forward forward_;
    std::optional<Upsample> upsample_;  // where the resolution is halved
    FrameExchange exchange_;
    Commands commands_;
    gpu::FrameStatus status_{};
    FrameView view_;  // view of the last render
    std::array<std::optional<MedianDepth>, std::size(kDepthReadings)> median_;  // once asked for
    std::array<std::optional<PointLight>, std::size(kDepthReadings)> point_light_;  // likewise
    std::vector<PassTime> pass_times_;
};

/// Converts float [3][H][W] planes to an interleaved image.
ImageF planes_to_image(const std::vector<float>& planes, int width, int height);
/// Converts the [2][H][W] of Forward::record_depth, sums of w z and of w, to what
/// Renderer::render_depth returns.
ImageF depth_image(const std::vector<float>& planes, int width, int height);

}  // namespace darb
