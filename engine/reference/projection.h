// Projection of one splat to the image plane, values and hand-derived gradients.
// Mean: pinhole. Covariance: S' = M M^T + low_pass I with M = sqrt(scale) J W R diag(s) (the EWA
// approximation of Zwicker et al. 2001), kept as the Cholesky factor of its inverse.
#pragma once

#include <string_view>

#include "engine/reference/kernel_table.h"
#include "engine/reference/splats.h"
#include "engine/scene/camera.h"

namespace darb::reference {

/// Why a splat takes no part: the CULL_* of shaders/shared/render_args.h, plus one. The first that
/// holds; `outside` comes last here, as it takes the tiles.
enum class Cull { none, near_plane, rotation, opacity, covariance, outside, colour };
constexpr int kCullCount = 7;
std::string_view cull_name(Cull cull);

template <class T>
struct ProjectedSplat {
    Cull cull = Cull::none;
    Vec2<T> mean_px{0};                    // px, pixel centres at +0.5
    T depth = 0;                           // camera z, world units
    T cov_xx = 0, cov_xy = 0, cov_yy = 0;  // S', px^2
    // q = (l11 dx + l21 dy)^2 + (l22 dy)^2 with (dx, dy) = mean_px - pixel centre; 1/px
    T l11 = 0, l21 = 0, l22 = 0;
    T opacity = 0;      // (0, 1), with the antialiasing factor where the model asks for it
    T exponent = 0;     // of a kernel with shapes
    T reach = 0;        // q from which alpha is below the cut-off
    Vec3<T> colour{0};  // >= 0
    /// The splat's depth at a pixel is depth - depth_slope . (u, v) in the mean, (u, v) the offset
    /// whitened by the factor.
    Vec2<T> depth_slope{0};
};

/// The nearest half-precision number, ties to even, of a value that a half has with all its bits.
double round_to_half(double x);

/// dL/d(each rendered quantity of a splat); zero for culled splats.
template <class T>
struct ProjectedGradient {
    Vec2<T> d_mean_px{0};  // 1/px
    T d_l11 = 0, d_l21 = 0, d_l22 = 0;
    T d_opacity = 0;
    T d_exponent = 0;
    T d_depth = 0;
    Vec3<T> d_colour{0};
};

/// dL/d(parameter), same shapes as Splats.
template <class T>
struct SplatGradients : SplatArrays<T> {
    void resize_like(const Splats<T>& splats);
};

/// dL/d(camera): of p_camera = rotation * p_world + translation, whose twelve numbers are each
/// taken freely, and of focal lengths and principal point. A lens keeps its own terms.
template <class T>
struct CameraGradients {
    Mat3<T> d_rotation{T(0)};  // as Camera::rotation: column, then row
    Vec3<T> d_translation{0};
    Vec2<T> d_focal{0}, d_principal{0};  // 1/px
    CameraGradients& operator+=(const CameraGradients& other);
};

/// Everything but `outside`, which takes the tiles. Index in [0, N). A culled splat has its cull
/// set and the rest unspecified.
template <class T>
ProjectedSplat<T> project(const Splats<T>& splats, size_t index, const Camera& camera,
                          const RenderSettings& settings, const KernelTable& kernel);

/// What project returned for a splat, and the gradient of that.
template <class T>
struct ProjectedPair {
    const ProjectedSplat<T>& splat;
    const ProjectedGradient<T>& gradient;
};

/// Writes the gradients of splat `index` into `out` (sized like the splats), and those of the
/// camera, where they are wanted, into `d_camera`. Does nothing for culled splats.
template <class T>
void project_backward(const Splats<T>& splats, size_t index, const Camera& camera,
                      const RenderSettings& settings, const KernelTable& kernel,
                      const ProjectedPair<T>& projected, SplatGradients<T>& out,
                      CameraGradients<T>* d_camera = nullptr);

}  // namespace darb::reference
