// The kernel whose shape each splat has of its own: `beta`, w = (1 - q/R^2)^b with b = 4 exp(t),
// R^2 = 13, and t the splat's attribute `shape`. t = 0, where training starts, is the kernel of the
// list and has the Gaussian's second moment. In closed form, where other kernels have fits and
// tables. Source: Deformable Beta Splatting (Liu et al. 2025); footprints: docs/math.md, Kernels.
#pragma once

#include <vector>

#include "engine/kernels/gaussian_equivalent.h"
#include "engine/kernels/kernel_family.h"

namespace darb {

bool kernel_has_shape(int kernel);

/// The exponent of the profile that is drawn: b with Footprint::psi, and b + 1/2, the line
/// integral, with exact; held between EXPONENT_LEAST, below which the slope at the edge has no
/// bound, and EXPONENT_MOST.
double shape_exponent(Footprint footprint, double shape);
/// d shape_exponent / d shape; 0 where it is held.
double shape_exponent_slope(Footprint footprint, double shape);
/// The shape with this exponent b of the kernel in space, not held.
double shape_of_exponent(double b);

/// The profile that is drawn at q >= 0, and its derivatives by q and by the exponent; all 0 from
/// the edge on.
struct ShapedValue {
    double w = 0, slope = 0, by_exponent = 0;
};
ShapedValue shaped_value(double exponent, double q);
/// As kernel_reach.
double shaped_reach(double exponent, double opacity, double cutoff);
/// What multiplies the projected covariance: psi = R^2 / (2 b + 5), or 1.
double shaped_covariance_scale(Footprint footprint, double exponent);
/// As rendered_second_moment, kernel_radius_quantile, relocation_scale and gaussian_equivalent.
double shaped_second_moment(Footprint footprint, double exponent);
/// count of them, at (k + 1/2) / count.
std::vector<double> shaped_radius_quantiles(Footprint footprint, double exponent, int count);
double shaped_relocation_scale(double exponent, double opacity, int count);
GaussianEquivalent shaped_gaussian(Footprint footprint, double exponent, bool keep_opacity);

/// The shapes of the rows of the tables that density control reads: SHAPE_ROWS of them, evenly from
/// SHAPE_FIRST to SHAPE_LAST.
double shape_of_row(int row);

}  // namespace darb
