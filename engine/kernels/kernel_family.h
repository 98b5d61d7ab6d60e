// SPDX-License-Identifier: MIT
// The family of reconstruction kernels in double: the one place that defines a kernel's maths. q =
// d^2 is the squared Mahalanobis distance of a pixel centre under the projected covariance. Source:
// DARB-Splatting, arXiv 2501.12369, corrected (errata in docs/paper.md).
#pragma once

#include <optional>
#include <string_view>

#include "shaders/shared/kernel_list.h"

namespace darb {

/// psi: profile w, with the 2x2 covariance scaled by psi before the low-pass filter. exact: the
/// line integral A of the 3D kernel, with the covariance unscaled.
enum class Footprint { psi = FOOTPRINT_PSI, exact = FOOTPRINT_EXACT };

/// Names as in files and on the command line: gaussian, raised_cosine, half_cosine_squared, sinc,
/// inverse_quadratic, cosine, squared_raised_cosine, inverse_multiquadric, parabolic; and kernels
/// with several pulses, see kernel_with_pulses.
std::string_view kernel_name(int kernel);
std::optional<int> kernel_from_name(std::string_view name);
/// The id of this kernel with `pulses` of its pulses. With 1 it is the listed kernel; others have
/// names that tell ("sinc_2_pulses"). Nothing where there is no such row.
std::optional<int> kernel_with_pulses(int kernel, int pulses);
int kernel_pulses(int kernel);
/// Whether Footprint::exact is allowed: not with several pulses.
bool has_exact_footprint(int kernel);
std::string_view footprint_name(Footprint footprint);  // psi, exact
std::optional<Footprint> footprint_from_name(std::string_view name);

/// R^2, the support in q; infinity for gaussian.
double kernel_support(int kernel);

/// The rendered profile at q >= 0: value(0) = 1, and 0 at and beyond the support. Accurate to
/// 1e-13.
double kernel_value(int kernel, Footprint footprint, double q);
/// d kernel_value / dq; 0 beyond the support.
double kernel_slope(int kernel, Footprint footprint, double q);

/// The smallest q from which on opacity * value < cutoff; 0 where opacity < cutoff; at most R^2.
double kernel_reach(int kernel, Footprint footprint, double opacity, double cutoff);

/// The paper's psi: ratio of the projected second moment to the 2x2 block of the 3D covariance,
/// including all pulses.
double kernel_psi(int kernel);
/// The factor on the 2x2 covariance: kernel_psi of the first pulse for Footprint::psi, 1 for exact.
/// Further pulses do not change it, so that they extend the support and nothing else.
double covariance_scale(int kernel, Footprint footprint);

/// The scale of a splat relative to the Gaussian that covers as much of the picture, i.e. whose
/// profile has the same integral over the plane. With several pulses: that of the first.
double equal_area_scale(int kernel, Footprint footprint);

/// Inverse of the cumulative radial density r^2 w(r^2) of the 3D kernel: u in [0,1) -> r, in
/// units of the standard deviation parameter. Splits draw their children's offsets from it.
/// gaussian: chi_3; with several pulses: that of the first.
double kernel_radius_quantile(int kernel, double u);

}  // namespace darb
