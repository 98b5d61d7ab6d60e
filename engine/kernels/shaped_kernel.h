// Kernels whose shape each splat has of its own. Each is one row of a table: a class that says all
// that is particular to it, in closed form where other kernels have fits and tables. What a splat
// is drawn with is its exponent, a function of its attribute `shape`; shape 0, where training
// starts, is the kernel of the list. shaders/kernels/shaped.glsl is the twin for devices. Formulas:
// docs/math.md, A shape of each splat.
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "engine/kernels/gaussian_equivalent.h"
#include "engine/kernels/kernel_family.h"

namespace darb {

/// The profile that is drawn at q >= 0, and its derivatives by q and by the exponent.
struct ShapedValue {
    double w = 0, slope = 0, by_exponent = 0;
};

class ShapedKernel {
  public:
    virtual ~ShapedKernel() = default;
    /// The exponent that is drawn of a shape, held between exponent_least and exponent_most.
    virtual double exponent(Footprint footprint, double shape) const = 0;
    /// d exponent / d shape; 0 where it is held.
    virtual double exponent_slope(Footprint footprint, double shape) const = 0;
    virtual double exponent_least() const = 0;
    virtual double exponent_most() const = 0;
    /// Tables over the shape reach from the first to the last: there the exponent is held.
    virtual double first_shape() const = 0;
    virtual double last_shape() const = 0;

    virtual ShapedValue value(Footprint footprint, double exponent, double q) const = 0;
    /// The q beyond which w is 0, or below 1e-9.
    virtual double extent(double exponent) const = 0;
    /// As kernel_reach.
    virtual double reach(Footprint footprint, double exponent, double opacity,
                         double cutoff) const = 0;
    /// What multiplies the projected covariance, psi or 1, and half of its logarithm's derivative
    /// by the exponent: that of the logarithm of lengths.
    virtual double covariance_scale(Footprint footprint, double exponent) const = 0;
    virtual double length_slope(Footprint footprint, double exponent) const = 0;
    /// As rendered_second_moment.
    virtual double second_moment(Footprint footprint, double exponent) const = 0;
    /// As kernel_radius_quantile: count of them, at (k + 1/2) / count.
    virtual std::vector<double> radius_quantiles(Footprint footprint, double exponent,
                                                 int count) const = 0;
    /// How far float32 may stray from value(): see float_rounding.
    virtual double rounding(double exponent) const = 0;
    /// From the least to the most, the start among them.
    virtual std::vector<double> exponents_to_check() const = 0;

    /// As relocation_scale and gaussian_equivalent.
    double relocation_scale(Footprint footprint, double exponent, double opacity, int count) const;
    GaussianEquivalent gaussian(Footprint footprint, double exponent, bool keep_opacity) const;
    /// The shapes of the SHAPE_ROWS rows of the tables that density control reads, evenly from
    /// first_shape to last_shape.
    double shape_of_row(int row) const;
};

bool kernel_has_shape(int kernel);
/// Of a kernel that has a shape.
const ShapedKernel& shaped_kernel(int kernel);
/// Those of the list, without blends.
std::vector<int> shaped_kernels();
/// The exponent of the scene's splat, of any kernel: 0 where it has no shape.
double splat_exponent(int kernel, Footprint footprint, double shape);

/// `beta`: w = (1 - q/R^2)^e, R^2 = BETA_SUPPORT, b = BETA_START exp(shape), e = b with
/// Footprint::psi and b + 1/2, the line integral, with exact. Source: Deformable Beta Splatting
/// (Liu et al. 2025).
const ShapedKernel& beta_kernel();
/// The shape of beta with this b of the kernel in space, not held.
double beta_shape_of(double b);
/// `generalized_exponential`: w = exp(-((q + s)^(t/2) - s^(t/2)) / 2), t = 2 exp(shape) its
/// exponent. s = EXPONENTIAL_SOFTENING bounds the slope at the centre, which without it is infinite
/// for t < 2. Its line integral has no closed form: Footprint::psi only. Source: GES (Hamdi et al.
/// 2024), whose renderer draws Gaussians of another size.
const ShapedKernel& exponential_kernel();
/// `ges_published`: what GES's program draws. w = exp(-q/2) whatever the exponent t = 2 + shape;
/// lengths are multiplied by f = 2 / (1 + exp(-0.1 (t - 2))), so covariance_scale is f^2.
/// Footprint::psi only: f is its psi. Source: GES (Hamdi et al. 2024), its program.
const ShapedKernel& ges_kernel();

/// The number of `blend:FIRST,SECOND`, of two different kernels of the list.
constexpr int blend_of(int first, int second) {
    return KERNEL_BLENDS + first * KERNEL_COUNT + second;
}
/// `blend:FIRST,SECOND` of two different kernels of the list: w = (1 - m) w1 + m w2. The weight in
/// space is 1 / (1 + exp(-shape)); m, the exponent, is that of what is drawn, which the exact
/// footprint's line integrals change.
constexpr std::string_view kBlendMark = "blend:";
std::optional<int> blend_from_name(std::string_view name);
/// Nothing of a kernel that is no blend.
std::optional<std::array<int, 2>> blend_parts(int kernel);
const ShapedKernel& blend_kernel(int kernel);
/// Of both kernels: the integral of w along a line through the centre (half of it), of r^2 w and of
/// r^4 w / 3 over r.
struct BlendFacts {
    std::array<double, 2> centre{}, second{}, fourth{};
};
const BlendFacts& blend_facts(int kernel);

}  // namespace darb
