// SPDX-License-Identifier: MIT
// Pictures of splats, and gradients of a caller's loss on them by every parameter: the calls from
// which to build a training loop of one's own. Gradients are exact derivatives of the picture that
// is drawn; engine/reference has the same in double.
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

/// Gradient by the twelve numbers of p_camera = rotation * p_world + translation, each treated as
/// free, and by focal lengths and principal point; the terms of a lens are constant. A rotation has
/// only three degrees of freedom: the part of the gradient along them counts.
struct CameraGradient {
    glm::dmat3 d_rotation{0.0};  // as Camera::rotation: column, then row
    glm::dvec3 d_translation{0.0};
    double d_fx = 0, d_fy = 0, d_cx = 0, d_cy = 0;  // 1/px
    glm::dvec3 d_turn{0.0}, d_move{0.0};            // of the shutter
};

/// Sums over the splats, in the order of shaders/shared/optim_args.h.
using CameraTotals = std::array<double, CAMERA_SUMS>;
CameraGradient camera_gradient(const Camera& camera, const CameraTotals& totals);

/// shares: [N][CAMERA_SHARES]. d_position: [N][3]; its sum is minus the gradient by the camera's
/// centre. Added up in double, in the order of the splats.
CameraGradient camera_gradient(const Camera& camera, std::span<const float> shares,
                               std::span<const float> d_position);

struct ViewGradients {
    ImageF image;          // [H][W][3] RGB, not clamped
    SplatArrays<float> d;  // dL/d(attribute), shaped like the model's arrays: by the logarithm of
                           // scales, the logit of opacities, and quaternions as stored, not
                           // normalised
    /// [N] |dL/d(mean)| in units of half the picture's sides, which density control uses.
    std::vector<float> mean_gradient_ndc;
    std::vector<std::uint8_t> shown;  // [N] 1 where the splat is listed in a tile of the picture
    gpu::FrameStatus status{};        // bad_gradients: splats whose gradients overflowed float32; 0
                                      // in d
    glm::dvec3 d_background{0.0};
    std::optional<CameraGradient> d_camera;  // if GradientOptions::camera
    /// [N][2] dL/d(projected mean), 1/px, if GradientOptions::camera; 0 for what is not shown.
    /// Where a mean lies so far outside the picture that the projection of its ellipsoid is held at
    /// the margin, the share of that is in it, too.
    std::vector<float> d_mean;
};

struct GradientOptions {
    int sh_degree = -1;                                   // degree of harmonics in use; -1: the
                                                          // model's
    float near_plane = static_cast<float>(NEAR_DEFAULT);  // world units along z
    Accuracy accuracy{};  // resorted pixels and halved pictures have no gradients
    /// The model holds opacities in [0, 1] and scales rather than logits and logarithms, and
    /// gradients are by these.
    bool linear_values = false;
    /// The model's sh_dc is the colour itself, which may be negative: nothing is added or clamped.
    bool direct_colour = false;
    bool camera = false;  // compute d_camera
};

/// The values of all splats, where the caller has them.
struct GivenValues {
    std::array<std::span<const float>, kAttributeCount> attributes;  // [N][floats] each
    std::span<const float> harmonics{};  // [N][K][3], all bands, in place of kShDc and kShRest; or
                                         // empty
};

/// One model on a device, for many views. Kernel, footprint and anti-aliasing are the model's.
class GradientRenderer {
  public:
    /// Uploads the model. Throws Error where its arrays do not fit together, or do not fit the
    /// device.
    GradientRenderer(Device& device, const SplatModel& model, const GradientOptions& options = {});
    ~GradientRenderer();
    GradientRenderer(GradientRenderer&&) noexcept;
    GradientRenderer& operator=(GradientRenderer&&) noexcept;

    /// Replaces the values of the splats, after a step by the caller. Throws Error where count,
    /// degree or origin differ.
    void update(const SplatModel& model);
    /// Replaces the splats by others of any count, degree and origin. Kernel, footprint and
    /// anti-aliasing stay, and so do pipelines and the frame's buffers.
    void replace(const SplatModel& model);
    /// Whether the splats have this count and degree, and origin 0.
    bool holds(std::size_t count, int sh_degree) const;
    /// Replaces the values of the splats piece by piece, provided that they are finite and that
    /// accept(attribute, piece) agrees; for `harmonics`, attribute is kShDc. accept is called by
    /// several threads, and must not throw. Returns false where a piece was refused; then all
    /// values are undefined until they are set again. Throws Error for a wrong number of values.
    bool set_values(const GivenValues& values,
                    const std::function<bool(int, std::span<const float>)>& accept);
    /// Replaces these two options from the next picture on.
    void set_view(int sh_degree, float near_plane);

    /// Renders RGB, not clamped; valid until the next call. Throws Error for a camera without
    /// pixels, or with numbers that are not finite.
    const ImageF& render(const Camera& camera, const glm::vec3& background = glm::vec3(0.0f));
    /// [H][W][1] 1 - transmittance of the last picture.
    const ImageF& alpha() const;
    /// Hand over the last picture and its alpha without a copy. render() and alpha() then have no
    /// pixels, nor does ViewGradients::image. backward() may still follow.
    ImageF release_image();
    ImageF release_alpha();
    /// [H][W][2] of the last picture, as Renderer::render_depth gives it; it has no gradients.
    ImageF depth();
    /// Gradients for the picture that render() made last, once for each picture. d_image [H][W][3]
    /// is dL/d(image); d_alpha is dL/d(alpha), [H][W][1] or empty for none. Throws Error for a
    /// wrong size, for values that are not finite, and where no picture was made.
    ViewGradients backward(const ImageF& d_image, const ImageF& d_alpha = {});

    /// The status of the last render.
    gpu::FrameStatus status() const;
    const std::vector<PassTime>& pass_times() const;
    std::uint32_t count() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Planes [4][H][W] as the device takes them: dL/d(image) [H][W][3] and dL/d(alpha) [H][W][1], 0
/// where that is empty. Throws Error where the size is not the picture's, or values are not finite.
std::vector<float> gradient_planes(const ImageF& d_image, const ImageF& d_alpha, int width,
                                   int height);

/// dL/d(image) [H][W][3] from the picture [H][W][3].
using ImageGradient = std::function<ImageF(const ImageF& image)>;

/// Renders one view and its gradients in one call. Throws Error as GradientRenderer does.
ViewGradients render_with_gradients(Device& device, const SplatModel& model, const Camera& camera,
                                    const glm::vec3& background, const ImageGradient& d_image,
                                    const GradientOptions& options = {});

}  // namespace darb
