// SPDX-License-Identifier: MIT
// Projection of one splat to the image plane, values and hand-derived gradients.
// Mean: pinhole. Covariance: S' = M M^T + low_pass I with M = sqrt(scale) J W R diag(s) (the EWA
// approximation of Zwicker et al. 2001), kept as the Cholesky factor of its inverse.
#pragma once

#include <array>
#include <string_view>

#include "engine/reference/kernel_table.h"
#include "engine/reference/splats.h"
#include "engine/scene/camera.h"
#include "engine/scene/sh_basis.h"

namespace darb::reference {

/// Why a splat takes no part: the CULL_* of shaders/shared/render_args.h, plus `none`. The first
/// reason that holds is given; `outside` is decided last, as it needs the tiles.
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
    T exponent = 0;     // for kernels with shapes
    T reach = 0;        // q from which alpha is below the cut-off
    Vec3<T> colour{0};  // >= 0
    /// The splat's depth at a pixel is depth - depth_slope . (u, v) in the mean, where (u, v) is
    /// the offset whitened by the factor l11, l21, l22.
    Vec2<T> depth_slope{0};
    /// The deviation of its depth, given the pixel; world units.
    T depth_deviation = 0;
};

/// The nearest half-precision number, ties to even, of a value in the range of normal halves.
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

/// dL/d(parameter), with the shapes of Splats.
template <class T>
struct SplatGradients : SplatArrays<T> {
    void resize_like(const Splats<T>& splats);
};

/// dL/d(camera): by the twelve numbers of p_camera = rotation * p_world + translation, each treated
/// as free, by focal lengths and principal point, and by a shutter. The terms of a lens are
/// constant.
template <class T>
struct CameraGradients {
    Mat3<T> d_rotation{T(0)};  // as Camera::rotation: column, then row
    Vec3<T> d_translation{0};
    Vec2<T> d_focal{0}, d_principal{0};  // 1/px
    Vec3<T> d_turn{0}, d_move{0};        // of the shutter
    CameraGradients& operator+=(const CameraGradients& other);
};

/// Decides everything but `outside`, which needs the tiles. index in [0, N). Where cull is set, the
/// other members are unspecified.
template <class T>
ProjectedSplat<T> project(const Splats<T>& splats, size_t index, const Camera& camera,
                          const RenderSettings& settings, const KernelTable& kernel);

/// What project returned for a splat, and the gradient by that.
template <class T>
struct ProjectedPair {
    const ProjectedSplat<T>& splat;
    const ProjectedGradient<T>& gradient;
};

/// Writes the gradients of splat `index` into `out` (sized like the splats) and, where they are
/// wanted, those of the camera into `d_camera`. Does nothing for culled splats.
template <class T>
void project_backward(const Splats<T>& splats, size_t index, const Camera& camera,
                      const RenderSettings& settings, const KernelTable& kernel,
                      const ProjectedPair<T>& projected, SplatGradients<T>& out,
                      CameraGradients<T>* d_camera = nullptr);

// The intermediate terms of a splat's projection, shared by the forward and the backward walk.

template <class T>
struct RotationTerms {
    Vec4<T> unit{0};  // w x y z of the normalised quaternion
    T norm = 0;       // that of the quaternion as stored
    Mat3<T> matrix{1};

    T w() const { return unit[0]; }
    T x() const { return unit[1]; }
    T y() const { return unit[2]; }
    T z() const { return unit[3]; }
};

/// matrix turns splat axes into world axes; q[4] is w x y z.
template <class T>
RotationTerms<T> rotation_terms(const T* q);

/// dL/dq from dL/dmatrix, through the normalisation.
template <class T>
Vec4<T> rotation_backward(const RotationTerms<T>& terms, const Mat3<T>& d_matrix);

/// x/z and y/z as the Jacobian uses them: clamped to the image and a margin around it.
template <class T>
struct RatioTerms {
    T x = 0, y = 0;                         // clamped
    bool x_inside = true, y_inside = true;  // false: the derivative of the clamped ratio is zero
};
template <class T>
RatioTerms<T> ratio_terms(const Vec3<T>& mean_camera, const Camera& camera);

/// The standard deviations after the 3D smoothing filter. factor: the share of the opacity that is
/// kept.
template <class T>
struct SmoothedScale {
    Vec3<T> scale{0};  // sqrt(s^2 + f^2), world units
    Vec3<T> share{1};  // s^2 / (s^2 + f^2) = d ln(scale) / d ln(s)
    T factor = 1;      // product of s / scale
};
template <class T>
SmoothedScale<T> smoothed_scale(const T* log_scale, T filter);

/// The camera as it was when the row of a splat was exposed; without a rolling shutter, itself.
template <class T>
struct RowCamera {
    Camera camera;  // its shutter has been dropped
    bool rolls = false;
    T time = 0;                 // of the row, as in engine/scene/camera.h
    Vec3<T> turn{0}, swing{0};  // its turn, and exp(time turn) move
    glm::dmat3 turned{1.0};     // exp(time turn)
};
template <class T>
RowCamera<T> row_camera(const T* position, const Camera& camera);

/// How a splat's centre moves in the picture while rows are exposed.
template <class T>
struct RowMotion {
    Vec3<T> velocity{0};  // of the mean in the camera, by the time
    Vec2<T> pixel{0};     // px, by the time
    T per_row = 0;        // the time by the row, 1/px; 0 where it is held
};

/// The sigma points of a splat, see reference_sigma_points.h. The default is a splat without.
template <class T>
struct SigmaTerms {
    bool used = false;
    std::array<Vec3<T>, 3> axis{};    // one standard deviation each, in the camera
    std::array<Vec2<T>, 6> offset{};  // px from the centre's pixel, of one moment
    Vec2<T> shear{0};                 // that the shutter adds to an offset, by its y
    Vec2<T> shift{0};                 // px, of the mean
    T xx = 0, xy = 0, yy = 0;         // covariance, px^2
    T xz = 0, yz = 0, zz = 0;         // with the depth, and its own
};

template <class T>
struct CovarianceTerms {
    RatioTerms<T> ratio;
    Vec3<T> own1{0}, own2{0};  // rows of the Jacobian of the pixel at a given time
    RowMotion<T> motion;
    Vec3<T> j1{0}, j2{0};  // those with the row's time free, J; px per world unit
    Vec3<T> k1{0}, k2{0};  // rows of J W
    SmoothedScale<T> smooth;
    Vec3<T> scale{0};  // standard deviations, filter included, world units
    T root = 1;        // sqrt of the footprint's covariance scale
    SigmaTerms<T> sigma;
    // Rows of M = root J W R diag(scale), px, and that of the depth. With sigma points, of the
    // lower triangular factor of their covariance.
    Vec3<T> r1{0}, r2{0}, r3{0};
    T shrink = 1;     // power of two that brings rows beyond ROW_LIMIT below 2 px
    T det_sharp = 0;  // |r1 x r2|^2: determinant before the low-pass, px^4 times shrink^4
    T det = 0;        // det S', px^4 times shrink^4
};

template <class T>
T clamped_scale(T log_scale);
/// World to camera rotation in the scalar T.
template <class T>
Mat3<T> view_rotation(const Camera& camera);
template <class T>
Vec3<T> mean_in_camera(const T* position, const Camera& camera);

template <class T>
CovarianceTerms<T> covariance_terms(const Vec3<T>& mean_camera, const RotationTerms<T>& rotation,
                                    const T* log_scale, T filter, const RowCamera<T>& row,
                                    const RenderSettings& settings, double covariance_scale);

/// The pixel of a point in the camera, whether or not the lens sees it.
template <class T>
Vec2<T> pixel_at(const Vec3<T>& mean, const Camera& camera);
/// Sets ratio, own1 and own2 for a point in the camera.
template <class T>
void set_rows(const Vec3<T>& mean_camera, const Camera& camera, CovarianceTerms<T>& c);

// Real spherical harmonics of degree 0 to 3 in the order and with the signs of 3DGS: the basis and
// its derivative with respect to the direction.

template <class T>
using ShBasis = std::array<T, kMaxShCoefficients>;
template <class T>
using ShBasisGradient = std::array<Vec3<T>, kMaxShCoefficients>;

/// basis[k] for k < (degree + 1)^2, 0 beyond; direction is of unit length. Colour before the
/// clamp is 0.5 + sum over k of basis[k] * coefficient[k].
template <class T>
ShBasis<T> sh_basis(int degree, const Vec3<T>& direction);

/// d basis[k] / d direction, of the polynomials in x, y, z as 3DGS writes them. Off the unit sphere
/// they are one continuation among many: project on the tangent plane before use.
template <class T>
ShBasisGradient<T> sh_basis_gradient(int degree, const Vec3<T>& direction);

}  // namespace darb::reference
