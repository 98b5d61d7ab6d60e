#include "engine/reference/projection_terms.h"

#include <algorithm>
#include <cmath>

#include "engine/reference/reference_lens.h"

namespace darb::reference {

template <class T>
RotationTerms<T> rotation_terms(const T* q) {
    RotationTerms<T> terms;
    terms.norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    terms.unit = Vec4<T>(q[0], q[1], q[2], q[3]) / terms.norm;
    const T w = terms.w(), x = terms.x(), y = terms.y(), z = terms.z();
    // Columns: images of the splat's axes.
    terms.matrix[0] = {1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)};
    terms.matrix[1] = {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)};
    terms.matrix[2] = {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)};
    return terms;
}

template <class T>
Vec4<T> rotation_backward(const RotationTerms<T>& terms, const Mat3<T>& d) {
    const T w = terms.w(), x = terms.x(), y = terms.y(), z = terms.z();
    // d[column][row]. Sum over the entries of matrix in which each component stands.
    const T d_w = 2 * (z * (d[0][1] - d[1][0]) + y * (d[2][0] - d[0][2]) + x * (d[1][2] - d[2][1]));
    const T d_x = 2 * (y * (d[0][1] + d[1][0]) + z * (d[0][2] + d[2][0]) + w * (d[1][2] - d[2][1]) -
                       2 * x * (d[1][1] + d[2][2]));
    const T d_y = 2 * (x * (d[0][1] + d[1][0]) + z * (d[1][2] + d[2][1]) + w * (d[2][0] - d[0][2]) -
                       2 * y * (d[0][0] + d[2][2]));
    const T d_z = 2 * (x * (d[0][2] + d[2][0]) + y * (d[1][2] + d[2][1]) + w * (d[0][1] - d[1][0]) -
                       2 * z * (d[0][0] + d[1][1]));
    const Vec4<T> d_unit(d_w, d_x, d_y, d_z);
    return (d_unit - terms.unit * glm::dot(terms.unit, d_unit)) / terms.norm;
}

template <class T>
RatioTerms<T> ratio_terms(const Vec3<T>& mean_camera, const Camera& camera) {
    const RayBounds bounds = ray_bounds(camera);
    const T min_x = T(bounds.low.x), max_x = T(bounds.high.x);
    const T min_y = T(bounds.low.y), max_y = T(bounds.high.y);
    const T x = mean_camera.x / mean_camera.z;
    const T y = mean_camera.y / mean_camera.z;
    return {std::clamp(x, min_x, max_x), std::clamp(y, min_y, max_y), x >= min_x && x <= max_x,
            y >= min_y && y <= max_y};
}

template <class T>
T clamped_scale(T log_scale) {
    return std::exp(std::clamp(log_scale, T(-LOG_SCALE_LIMIT), T(LOG_SCALE_LIMIT)));
}

template <class T>
SmoothedScale<T> smoothed_scale(const T* log_scale, T filter) {
    SmoothedScale<T> s;
    for (int c = 0; c < 3; ++c) {
        const T sharp = clamped_scale(log_scale[c]);
        s.scale[c] = filter > 0 ? std::sqrt(sharp * sharp + filter * filter) : sharp;
        const T kept = filter > 0 ? sharp / s.scale[c] : T(1);
        s.share[c] = kept * kept;
        s.factor *= kept;
    }
    return s;
}

template <class T>
Mat3<T> view_rotation(const Camera& camera) {
    return Mat3<T>(camera.rotation);
}

template <class T>
Vec3<T> mean_in_camera(const T* position, const Camera& camera) {
    return view_rotation<T>(camera) * Vec3<T>(position[0], position[1], position[2]) +
           Vec3<T>(camera.translation);
}

/// So that fourth powers of the rows stay within float where they leave it; in double it is exact.
template <class T>
T row_shrink(const Vec3<T>& r1, const Vec3<T>& r2) {
    T longest = 0;
    for (int k = 0; k < 3; ++k) longest = std::max({longest, std::abs(r1[k]), std::abs(r2[k])});
    return longest > T(ROW_LIMIT) ? std::ldexp(T(1), -std::ilogb(longest)) : T(1);
}

template <class T>
CovarianceTerms<T> covariance_terms(const Vec3<T>& mean_camera, const RotationTerms<T>& rotation,
                                    const T* log_scale, T filter, const Camera& camera,
                                    double low_pass, double covariance_scale) {
    CovarianceTerms<T> c;
    c.ratio = ratio_terms(mean_camera, camera);
    const T fx = T(camera.fx), fy = T(camera.fy), z = mean_camera.z;
    c.j1 = {fx / z, 0, -fx * c.ratio.x / z};
    c.j2 = {0, fy / z, -fy * c.ratio.y / z};
    if (camera.lens.active) {
        const Vec3<T> along_x(1 / z, 0, -c.ratio.x / z), along_y(0, 1 / z, -c.ratio.y / z);
        const Mat2<T> d = lens_point(camera.lens, Vec2<T>(c.ratio.x, c.ratio.y)).jacobian;
        c.j1 = fx * (d[0][0] * along_x + d[1][0] * along_y);
        c.j2 = fy * (d[0][1] * along_x + d[1][1] * along_y);
    }
    const Mat3<T> view = view_rotation<T>(camera);
    c.k1 = c.j1 * view;
    c.k2 = c.j2 * view;
    c.smooth = smoothed_scale(log_scale, filter);
    c.scale = c.smooth.scale;
    c.root = T(std::sqrt(covariance_scale));
    c.r1 = c.root * (c.k1 * rotation.matrix) * c.scale;
    c.r2 = c.root * (c.k2 * rotation.matrix) * c.scale;
    c.shrink = row_shrink(c.r1, c.r2);
    const Vec3<T> r1 = c.r1 * c.shrink, r2 = c.r2 * c.shrink, cross = glm::cross(r1, r2);
    const T h = T(low_pass) * c.shrink * c.shrink;
    c.det_sharp = glm::dot(cross, cross);
    // det(M M^T + h I) without the cancellation of A C - B^2 (Lagrange's identity).
    c.det = c.det_sharp + h * (glm::dot(r1, r1) + glm::dot(r2, r2)) + h * h;
    return c;
}

#define DARB_INSTANTIATE(T)                                                               \
    template RotationTerms<T> rotation_terms(const T*);                                   \
    template Vec4<T> rotation_backward(const RotationTerms<T>&, const Mat3<T>&);          \
    template RatioTerms<T> ratio_terms(const Vec3<T>&, const Camera&);                    \
    template T clamped_scale(T);                                                          \
    template SmoothedScale<T> smoothed_scale(const T*, T);                                \
    template Mat3<T> view_rotation(const Camera&);                                        \
    template Vec3<T> mean_in_camera(const T*, const Camera&);                             \
    template CovarianceTerms<T> covariance_terms(const Vec3<T>&, const RotationTerms<T>&, \
                                                 const T*, T, const Camera&, double, double);
DARB_INSTANTIATE(double)
DARB_INSTANTIATE(float)
#undef DARB_INSTANTIATE

}  // namespace darb::reference
