// SPDX-License-Identifier: MIT
// Kernels whose shape differs from splat to splat. Each is one row of a table: a class with
// everything particular to it, in closed form where other kernels have fits and tables. A splat is
// drawn with an exponent, which is a function of its attribute `shape`; shape 0, where training
// starts, gives the listed kernel. shaders/kernels/shaped.glsl is the twin for devices. Formulas:
// docs/math.md, A shape of each splat.
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "engine/kernels/kernel_family.h"
#include "engine/kernels/kernel_profile.h"

namespace darb {

/// The drawn profile at q >= 0, and its derivatives by q and by the exponent.
struct ShapedValue {
    double w = 0, slope = 0, by_exponent = 0;
};

class ShapedKernel {
  public:
    virtual ~ShapedKernel() = default;
    /// The exponent that a shape is drawn with, clamped to [exponent_least, exponent_most].
    virtual double exponent(Footprint footprint, double shape) const = 0;
    /// d exponent / d shape; 0 where it is clamped.
    virtual double exponent_slope(Footprint footprint, double shape) const = 0;
    virtual double exponent_least() const = 0;
    virtual double exponent_most() const = 0;
    /// Tables over the shape range from the first to the last; beyond, the exponent is clamped.
    virtual double first_shape() const = 0;
    virtual double last_shape() const = 0;

    virtual ShapedValue value(Footprint footprint, double exponent, double q) const = 0;
    /// The q from which on w is 0, or below 1e-9.
    virtual double extent(double exponent) const = 0;
    /// As kernel_reach.
    virtual double reach(Footprint footprint, double exponent, double opacity,
                         double cutoff) const = 0;
    /// The factor on the projected covariance, psi or 1, and half the derivative of its logarithm
    /// by the exponent, which is the derivative of the logarithm of lengths.
    virtual double covariance_scale(Footprint footprint, double exponent) const = 0;
    virtual double length_slope(Footprint footprint, double exponent) const = 0;
    /// As rendered_second_moment.
    virtual double second_moment(Footprint footprint, double exponent) const = 0;
    /// As kernel_radius_quantile, for `count` values of u, at (k + 1/2) / count.
    virtual std::vector<double> radius_quantiles(Footprint footprint, double exponent,
                                                 int count) const = 0;
    /// How far float32 may be from value(): see float_rounding.
    virtual double rounding(double exponent) const = 0;
    /// From the least to the most, including the start.
    virtual std::vector<double> exponents_to_check() const = 0;

    /// As relocation_scale and gaussian_equivalent.
    double relocation_scale(Footprint footprint, double exponent, double opacity, int count) const;
    GaussianEquivalent gaussian(Footprint footprint, double exponent, bool keep_opacity) const;
    /// The shapes for the SHAPE_ROWS rows of the tables that density control reads, evenly spaced
    /// from first_shape to last_shape.
    double shape_of_row(int row) const;
};

bool kernel_has_shape(int kernel);
/// The class of a kernel that has shapes.
const ShapedKernel& shaped_kernel(int kernel);
/// Kernels with shapes in the list, without blends.
std::vector<int> shaped_kernels();
/// The exponent of a splat with any kernel: 0 where the kernel has no shapes.
double splat_exponent(int kernel, Footprint footprint, double shape);

/// `beta`: w = (1 - q/R^2)^e, R^2 = BETA_SUPPORT, b = BETA_START exp(shape), e = b with
/// Footprint::psi and b + 1/2, the line integral, with exact. Source: Deformable Beta Splatting
/// (Liu et al. 2025).
const ShapedKernel& beta_kernel();
/// The shape of `beta` at which the kernel in space has this exponent b; not clamped.
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

/// The id of `blend:FIRST,SECOND`, a blend of two different kernels of the list.
constexpr int blend_of(int first, int second) {
    return KERNEL_BLENDS + first * KERNEL_COUNT + second;
}
/// `blend:FIRST,SECOND` blends two different kernels of the list: w = (1 - m) w1 + m w2. The weight
/// in space is 1 / (1 + exp(-shape)). m, the exponent, is the weight in the picture, which differs
/// for the exact footprint because of its line integrals.
constexpr std::string_view kBlendMark = "blend:";
std::optional<int> blend_from_name(std::string_view name);
/// The two kernels of a blend; nothing for other kernels.
std::optional<std::array<int, 2>> blend_parts(int kernel);
const ShapedKernel& blend_kernel(int kernel);
/// For both kernels: half the integral of w along a line through the centre, and the integrals of
/// r^2 w and of r^4 w / 3 over r.
struct BlendFacts {
    std::array<double, 2> centre{}, second{}, fourth{};
};
const BlendFacts& blend_facts(int kernel);

}  // namespace darb
