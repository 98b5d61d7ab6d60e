// Pictures of splats and what a caller's loss of them says of every parameter, in calls that a
// training loop of one's own is made of. Gradients are exact derivatives of the picture that is
// drawn; engine/reference has the same in double.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/core/image.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/device.h"
#include "engine/plan/accuracy.h"
#include "engine/scene/camera.h"
#include "engine/scene/splat_model.h"
#include "shaders/shared/limits.h"
#include "shaders/shared/optim_args.h"
#include "shaders/shared/render_args.h"

namespace darb {

/// Of p_camera = rotation * p_world + translation, whose twelve numbers are each taken freely, and
/// of focal lengths and principal point; a lens keeps its own terms. A rotation has three degrees
/// of freedom: what counts is the part along them.
struct CameraGradient {
    glm::dmat3 d_rotation{0.0};  // as Camera::rotation: column, then row
    glm::dvec3 d_translation{0.0};
    double d_fx = 0, d_fy = 0, d_cx = 0, d_cy = 0;  // 1/px
};

/// Sums over the splats, as shaders/shared/optim_args.h orders them.
using CameraTotals = std::array<double, CAMERA_SUMS>;
CameraGradient camera_gradient(const Camera& camera, const CameraTotals& totals);

/// shares: [N][CAMERA_SHARES]. d_position: [N][3], whose sum is that of the centre,
/// negative. Added in double in the order of the splats.
CameraGradient camera_gradient(const Camera& camera, std::span<const float> shares,
                               std::span<const float> d_position);

struct ViewGradients {
    ImageF image;          // [H][W][3] RGB, not clamped
    SplatArrays<float> d;  // dL/d(attribute), as the model's arrays: of the logarithm of scales, of
                           // the logit of opacities, of quaternions as they are, not normalised
    /// [N] |dL/d(mean)| in units of half the picture's sides, what density control goes by.
    std::vector<float> mean_gradient_ndc;
    std::vector<std::uint8_t> shown;  // [N] 1 where a tile of the picture lists the splat
    gpu::FrameStatus status{};        // bad_gradients: splats whose gradients left float32; 0 in d
    glm::dvec3 d_background{0.0};
    std::optional<CameraGradient> d_camera;  // where GradientOptions ask for it
};

struct GradientOptions {
    int sh_degree = -1;                                   // harmonics in use; -1: all of the model
    float near_plane = static_cast<float>(NEAR_DEFAULT);  // world units along z
    Accuracy accuracy{};  // but for resorted pixels and halved pictures, which have no gradients
    /// The model's opacities and scales are these themselves, opacities in [0, 1], and so are their
    /// gradients; not logits and logarithms.
    bool linear_values = false;
    /// The model's sh_dc is the colour, which may be negative: nothing is added and nothing
    /// clamped.
    bool direct_colour = false;
    bool camera = false;  // d_camera
};

/// The values of all splats, where a caller has them.
struct GivenValues {
    std::array<std::span<const float>, kAttributeCount> attributes;  // [N][floats] each
    std::span<const float> harmonics{};  // [N][K][3], all bands: for kShDc and kShRest, or none
};

/// One model on a device for many views. Kernel, footprint and anti-aliasing are the model's.
class GradientRenderer {
  public:
    /// Uploads the model. Throws Error where its arrays do not fit together, or the device.
    GradientRenderer(Device& device, const SplatModel& model, const GradientOptions& options = {});
    ~GradientRenderer();
    GradientRenderer(GradientRenderer&&) noexcept;
    GradientRenderer& operator=(GradientRenderer&&) noexcept;

    /// Other values for the same splats, after a step of the caller's. Throws Error where count,
    /// degree or origin are others.
    void update(const SplatModel& model);
    /// Other splats, of any count, degree and origin; kernel, footprint and anti-aliasing are as
    /// before. Pipelines and the frame's buffers stay.
    void replace(const SplatModel& model);
    /// Whether the splats are of this count and degree, and of origin 0.
    bool holds(std::size_t count, int sh_degree) const;
    /// Other values for the same splats, a piece at a time, where they are finite and
    /// accept(attribute, piece) says so, kShDc for `harmonics`. It is called by several threads and
    /// must not throw. False where a piece was refused: all is undefined until it is set again.
    /// Throws Error for another number of values.
    bool set_values(const GivenValues& values,
                    const std::function<bool(int, std::span<const float>)>& accept);
    /// From the next picture on, in place of what the options say.
    void set_view(int sh_degree, float near_plane);

    /// RGB, not clamped, there until the next call. Throws Error for a camera without pixels or
    /// with what is no number.
    const ImageF& render(const Camera& camera, const glm::vec3& background = glm::vec3(0.0f));
    /// [H][W][1], of the same picture: 1 - transmittance.
    const ImageF& alpha() const;
    /// The two of the last picture for the caller to keep, without a copy: render() and alpha()
    /// have no pixels then, nor has ViewGradients::image. backward() may follow all the same.
    ImageF release_image();
    ImageF release_alpha();
    /// [H][W][2] of the same picture, as Renderer::render_depth; there are no gradients of it then.
    ImageF depth();
    /// Of the picture that render() last made, once for each; d_image [H][W][3] is dL/d(image),
    /// d_alpha [H][W][1], or empty for none, dL/d(alpha). Throws Error for another size, for values
    /// that are not finite, and where no picture was made.
    ViewGradients backward(const ImageF& d_image, const ImageF& d_alpha = {});

    /// Of the last render.
    gpu::FrameStatus status() const;
    const std::vector<PassTime>& pass_times() const;
    std::uint32_t count() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// [4][H][W] as the device takes them: dL/d(image) [H][W][3] and dL/d(alpha) [H][W][1], 0 where
/// that is empty. Throws Error for another size than that of the picture and for what is not
/// finite.
std::vector<float> gradient_planes(const ImageF& d_image, const ImageF& d_alpha, int width,
                                   int height);

/// dL/d(image) [H][W][3] from the picture [H][W][3].
using ImageGradient = std::function<ImageF(const ImageF& image)>;

/// The same in one call, for one view. Throws Error as the class does.
ViewGradients render_with_gradients(Device& device, const SplatModel& model, const Camera& camera,
                                    const glm::vec3& background, const ImageGradient& d_image,
                                    const GradientOptions& options = {});

}  // namespace darb
