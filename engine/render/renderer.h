// Renderer: one model on one device, pictures of it for any camera, at a chosen accuracy.
#pragma once

#include <optional>

#include "engine/core/image.h"
#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/plan/accuracy.h"
#include "engine/raster/forward.h"
#include "engine/raster/frame_buffers.h"
#include "engine/scene/camera.h"
#include "shaders/shared/render_args.h"

namespace darb {

class FrameExchange {
  public:
    explicit FrameExchange(Device& device);

    /// First of a frame; no earlier one may still run. The camera goes to cameras(), at index 0.
    void send(Commands& commands, const gpu::CameraData& camera);
    const Buffer& cameras() const { return cameras_; }

    /// Last of a frame: its gpu::FrameStatus, which status() has once the frame was waited for.
    void fetch(Commands& commands, const Buffer& status);
    gpu::FrameStatus status() const;

  private:
    Buffer cameras_, camera_host_, status_host_;
};

// Upsample: a picture rendered at half the size, interpolated to the size that is shown.

/// The same view at another size.
Camera resized(const Camera& camera, int width, int height);
/// With half the pixels each way, rounded up.
Camera halved(const Camera& camera);

class Upsample {
  public:
    explicit Upsample(Device& device);
    /// Records the pass. image: float [3][H][W] of `rendered`. Returns one of the size of `shown`,
    /// there until the next call.
    const Buffer& record(Commands& commands, const Buffer& image, const Camera& rendered,
                         const Camera& shown);

  private:
    Device* device_;
    Pipeline pipeline_;
    Buffer image_;
};

class Renderer {
  public:
    /// Uploads the model; effects.antialias is taken from it. Cameras with a lens need
    /// effects.lens.
    Renderer(Device& device, const SplatModel& model, const Accuracy& accuracy = {},
             const ProjectionEffects& effects = {},
             HugeSplatPath huge_splat_path = HugeSplatPath::by_counters);
    /// options as they are, but for kernel, footprint and effects.antialias, which are the
    /// model's.
    Renderer(Device& device, const SplatModel& model, const ForwardOptions& options);

    /// RGB, not clamped. sh_degree -1: all that the accuracy allows. Grows its buffers and repeats
    /// the frame when it has more splat-tile intersections than before.
    ImageF render(const Camera& camera, const glm::vec3& background = glm::vec3(0.0f),
                  int sh_degree = -1, float near_plane = static_cast<float>(NEAR_DEFAULT));
    /// The same without its way to the host, for who measures: float [3][H][W] on the device, which
    /// the next frame overwrites.
    const Buffer& draw(const Camera& camera, const glm::vec3& background = glm::vec3(0.0f),
                       int sh_degree = -1, float near_plane = static_cast<float>(NEAR_DEFAULT));

    /// Of the camera of the last render, which must have been one. [H][W][2]: the expected depth
    /// sum w z / sum w along the optical axis, world units, and sum w, the opacity of the pixel;
    /// depth 0 where nothing is seen (opacity below 1/255).
    ImageF render_depth();

    /// Of the last render.
    gpu::FrameStatus status() const { return status_; }
    const std::vector<PassTime>& pass_times() const { return pass_times_; }

  private:
    Renderer(Device& device, const SplatModel& model, const FrameAccuracy& accuracy);

    FrameAccuracy accuracy_;
    GpuSplats splats_;
    FrameBuffers buffers_;
    Forward forward_;
    std::optional<Upsample> upsample_;  // where the resolution is halved
    FrameExchange exchange_;
    Commands commands_;
    gpu::FrameStatus status_{};
    FrameView view_;  // of the last render
    std::vector<PassTime> pass_times_;
};

/// float [3][H][W] planes to an interleaved image.
ImageF planes_to_image(const std::vector<float>& planes, int width, int height);
/// [2][H][W] of Forward::record_depth, sums of w z and of w, to what Renderer::render_depth gives.
ImageF depth_image(const std::vector<float>& planes, int width, int height);

}  // namespace darb
