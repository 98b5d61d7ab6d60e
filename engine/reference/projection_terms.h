// The intermediate terms of a splat's projection, shared by the forward and the backward walk.
#pragma once

#include "engine/reference/projection.h"

namespace darb::reference {

template <class T>
struct RotationTerms {
    Vec4<T> unit{0};  // w x y z of the normalised quaternion
    T norm = 0;       // of the parameter
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

/// x/z and y/z as the Jacobian sees them: clamped to the image and a margin around it.
template <class T>
struct RatioTerms {
    T x = 0, y = 0;                         // clamped
    bool x_inside = true, y_inside = true;  // false: the derivative of the clamped ratio is zero
};
template <class T>
RatioTerms<T> ratio_terms(const Vec3<T>& mean_camera, const Camera& camera);

/// What the 3D smoothing filter makes of the standard deviations. factor: what the opacity keeps.
template <class T>
struct SmoothedScale {
    Vec3<T> scale{0};  // sqrt(s^2 + f^2), world units
    Vec3<T> share{1};  // s^2 / (s^2 + f^2) = d ln(scale) / d ln(s)
    T factor = 1;      // product of s / scale
};
template <class T>
SmoothedScale<T> smoothed_scale(const T* log_scale, T filter);

template <class T>
struct CovarianceTerms {
    RatioTerms<T> ratio;
    Vec3<T> j1{0}, j2{0};  // rows of the Jacobian J, px per world unit
    Vec3<T> k1{0}, k2{0};  // rows of J W
    SmoothedScale<T> smooth;
    Vec3<T> scale{0};      // standard deviations, filter included, world units
    T root = 1;            // sqrt of the footprint's covariance scale
    Vec3<T> r1{0}, r2{0};  // rows of M = root J W R diag(scale), px
    T shrink = 1;          // power of two that brings rows beyond ROW_LIMIT below 2 px
    T det_sharp = 0;       // |r1 x r2|^2: determinant before the low-pass, px^4 times shrink^4
    T det = 0;             // of S', px^4 times shrink^4
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
                                    const T* log_scale, T filter, const Camera& camera,
                                    double low_pass, double covariance_scale);

}  // namespace darb::reference
