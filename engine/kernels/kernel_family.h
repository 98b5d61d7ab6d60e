// The family of reconstruction kernels in double: the one place where a kernel's maths stands.
// q = d^2, the squared Mahalanobis distance of a pixel centre under the projected covariance.
// Source: DARB-Splatting, arXiv 2501.12369, corrected (errata in docs/paper.md).
#pragma once

#include <optional>
#include <string_view>

#include "shaders/shared/kernel_list.h"

namespace darb {

/// psi: profile w, 2x2 covariance scaled by psi before the low-pass. exact: the line integral A of
/// the 3D kernel, covariance not scaled.
enum class Footprint { psi = FOOTPRINT_PSI, exact = FOOTPRINT_EXACT };

/// Names as in files and on the command line: gaussian, raised_cosine, half_cosine_squared, sinc,
/// inverse_quadratic, cosine, squared_raised_cosine, inverse_multiquadric, parabolic; and the rows
/// of more than one pulse, see kernel_with_pulses.
std::string_view kernel_name(int kernel);
std::optional<int> kernel_from_name(std::string_view name);
/// The row of the same kernel with this many of its pulses: 1 is the kernel of the list, others
/// have names that say so ("sinc_2_pulses"). Nothing where the kernel has no such row.
std::optional<int> kernel_with_pulses(int kernel, int pulses);
int kernel_pulses(int kernel);
/// Whether Footprint::exact may be asked for: not with more than one pulse.
bool has_exact_footprint(int kernel);
std::string_view footprint_name(Footprint footprint);  // psi, exact
std::optional<Footprint> footprint_from_name(std::string_view name);

/// R^2, the support in q; infinity for gaussian.
double kernel_support(int kernel);

/// The rendered profile at q >= 0: value(0) = 1, 0 at and beyond the support. Accurate to 1e-13.
double kernel_value(int kernel, Footprint footprint, double q);
/// d kernel_value / dq; 0 beyond the support.
double kernel_slope(int kernel, Footprint footprint, double q);

/// The smallest q at and beyond which opacity * value < cutoff; 0 when opacity < cutoff; at most
/// R^2.
double kernel_reach(int kernel, Footprint footprint, double opacity, double cutoff);

/// Ratio of the projected second moment to the 2x2 block of the 3D covariance (paper's psi), rings
/// included.
double kernel_psi(int kernel);
/// What multiplies the 2x2 covariance: kernel_psi of the first pulse for Footprint::psi, 1 for
/// exact. Rings leave it, so that the limit is all that they change.
double covariance_scale(int kernel, Footprint footprint);

/// The scale of a splat over that of the Gaussian that covers as much of the picture: the profiles
/// of both have the same integral over the plane. With rings: of the first pulse.
double equal_area_scale(int kernel, Footprint footprint);

/// Inverse of the cumulative radial density r^2 w(r^2) of the 3D kernel: u in [0,1) -> r (in units
/// of the standard deviation parameter). Splits draw children's offsets from it; gaussian: chi_3;
/// with rings: of the first pulse.
double kernel_radius_quantile(int kernel, double u);

}  // namespace darb
