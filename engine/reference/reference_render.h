// SPDX-License-Identifier: MIT
// The whole walk in one call each way: project, list and blend; and back to every parameter. Cost:
// 150,000 splats at 1280x720 take 0.5 to 0.8 s forward and 0.6 to 1.3 s back on two cores.
#pragma once

#include <array>

#include "engine/reference/blend.h"

namespace darb::reference {

/// What a render keeps for comparison and for the backward walk. Splat arrays are in model order.
template <class T>
struct BasicRenderResult {
    BlendImages<T> images;
    std::vector<ProjectedSplat<T>> projected;  // [N]
    TileLists tiles;
    std::array<size_t, kCullCount> culled{};  // splats by Cull; culled[0] is the visible count

    size_t visible_count() const { return culled[0]; }
};

template <class T>
struct BasicGradients {
    SplatGradients<T> splats;                     // as the model's arrays
    std::vector<ProjectedGradient<T>> projected;  // [N]
    /// [N] |dL/d(mean)| in NDC units, sqrt((d_x W/2)^2 + (d_y H/2)^2); 0 for culled splats.
    std::vector<T> mean_gradient_ndc;
    Vec3<T> background{0};
    CameraGradients<T> camera;
};

using RenderResult = BasicRenderResult<double>;
using Gradients = BasicGradients<double>;

/// Kernel, footprint, degree and antialiasing come from the splats. N = 0 is allowed.
template <class T>
BasicRenderResult<T> render(const Splats<T>& splats, const Camera& camera,
                            const RenderSettings& settings);

/// `result` must be render's for the same splats, camera and settings. d_image [H][W][3] is
/// dL/d(image); d_alpha and d_depth, [H][W][1] or empty for none, are dL/d(1 - transmittance) and
/// dL/d(depth); a second channel of d_depth is dL/d(square).
template <class T>
BasicGradients<T> backward(const Splats<T>& splats, const Camera& camera,
                           const RenderSettings& settings, const BasicRenderResult<T>& result,
                           const Image<T>& d_image, const Image<T>& d_alpha = {},
                           const Image<T>& d_depth = {});

/// Renders in double from the float parameters of a model.
RenderResult render(const SplatModel& model, const Camera& camera, const RenderSettings& settings);
Gradients backward(const SplatModel& model, const Camera& camera, const RenderSettings& settings,
                   const RenderResult& result, const Image<double>& d_image,
                   const Image<double>& d_alpha = {}, const Image<double>& d_depth = {});

}  // namespace darb::reference
