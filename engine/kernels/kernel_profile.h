// SPDX-License-Identifier: MIT
// One row per kernel: its name, its profile in double, its support and the order of its edge.
// Everything else (slope, reach, psi, exact footprint, radial density, shader coefficients) is
// derived from the row by DerivedKernel and kernel_coefficients.
#pragma once

#include <complex>
#include <functional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/kernels/kernel_family.h"
#include "shaders/shared/kernel_forms.h"

namespace darb {

/// The profile as a function of complex q, so that its derivative is exact: slope(q) is Im
/// profile(q + ih) / h with h far below rounding. It must be analytic on a neighbourhood of [0,
/// support], accurate to a few ulp relative to its value, 1 at q = 0 and falling on the support.
using Profile = std::function<std::complex<double>(std::complex<double> q)>;

/// Kernels that oscillate beyond their first zero may keep some of the following pulses. w is then
/// smooth, and falls from its peak to 0 within each pulse.
struct Pulses {
    int count = 1;
    double first_end = 0, period = 0;  // positions of the zeros, in d; unused with one pulse
};

struct KernelProfile {
    std::string_view name;
    double support;  // R^2 in q; infinity: the profile is the Gaussian
    int edge_order;  // order of the zero at the edge, in u = 1 - q/R^2: 0 jump, 1 kink, 2 double
                     // zero, ...
    int form;        // KERNEL_FORM_*: how shaders compute it; COMPACT unless w has poles nearby
    Profile profile;
    int kernel = -1;  // KERNEL_* for the shaders, where that differs from the row's own number
    Pulses pulses{};
    bool given = false;  // by a KernelDefinition: all that is known of its shape is that it falls
};

/// The rows, indexed by KERNEL_*, followed by the registered kernels; see kernel_registry.h.
const KernelProfile& kernel_profile(int kernel);
/// The profile of a blend at weight 1/2.
const KernelProfile& blend_profile(int kernel);
/// Only the kernels of the list and those with several pulses, below KERNEL_ROWS.
const KernelProfile& listed_profile(int kernel);
/// KERNEL_* as shaders know it: for several pulses the kernel with one, for a registered kernel one
/// with the same form.
int shader_kernel(int kernel);
/// Whether w is not 0 at the support's edge, as with inverse_quadratic. The slope of the exact
/// footprint is infinite there.
bool ends_with_a_jump(int kernel);

/// A polynomial on [0, 1] in the Chebyshev basis.
class ChebyshevSeries {
  public:
    ChebyshevSeries() = default;
    /// Interpolates samples[j] = f((1 + cos(pi (j + 1/2) / n)) / 2); drops a negligible tail.
    explicit ChebyshevSeries(const std::vector<double>& samples);
    static ChebyshevSeries of_coefficients(std::vector<double> coefficients) {
        ChebyshevSeries series;
        series.coefficients_ = std::move(coefficients);
        return series;
    }
    /// Coefficients of T_k(2u - 1), rising k; empty only where default-constructed.
    const std::vector<double>& coefficients() const { return coefficients_; }
    /// Value and derivative at u in [0, 1].
    void evaluate(double u, double& value, double& derivative) const;
    std::complex<double> value(std::complex<double> u) const;

  private:
    std::vector<double> coefficients_;
};

/// A row and everything that follows from it. Building it takes about a millisecond; value and
/// slope about 0.1 us, reach and radius_quantile about 10 us.
class DerivedKernel {
  public:
    explicit DerivedKernel(const KernelProfile& row);

    const KernelProfile& row() const { return row_; }
    /// The ratio of moments over the whole support, all pulses included.
    double psi() const { return psi_; }
    /// Where a pulse (1 to row().pulses.count) peaks and where it ends, in q.
    struct Pulse {
        double peak = 0, end = 0;
    };
    const std::vector<Pulse>& pulses() const { return pulses_; }
    /// Integral of r^power w(r^2) from 0 to radius.
    double radial_moment(double radius, int power) const;
    /// See kernel_family.h for these six.
    double value(Footprint footprint, double q) const;
    double slope(Footprint footprint, double q) const;
    double reach(Footprint footprint, double opacity, double cutoff) const;
    double covariance_scale(Footprint footprint) const;
    double equal_area_scale(Footprint footprint) const;
    double radius_quantile(double u) const;

  private:
    void find_pulses();
    void footprint_parts(double q, double& u, double& p, double& dp) const;

    KernelProfile row_;
    std::vector<Pulse> pulses_;
    double radius_ = 0;  // end of the support or the first pulse, or where a Gaussian is below
                         // rounding
    double psi_ = 1, scale_ = 1;
    double radial_mass_ = 1;     // integral of r^2 w(r^2) over the ball of the first pulse
    ChebyshevSeries footprint_;  // A(q) / (A(0) u^(edge_order + 1/2)), in u
};

/// The shared instance for KERNEL_*; built at first use, thread-safe.
const DerivedKernel& derived_kernel(int kernel);

// The Gaussian nearest to a kernel, for viewers that know only Gaussians.

struct GaussianEquivalent {
    double covariance;  // factor on the splat's covariance; includes the footprint's scale
    double opacity;     // factor on the opacity; 1 where that is kept
    double error;       // relative L2 distance of the two profiles over the image plane
};

/// Least squares over the plane between the rendered profile and opacity * exp(-q/(2c)). Keeping
/// the opacity preserves the order of visibility; freeing it gives a closer fit.
GaussianEquivalent gaussian_equivalent(int kernel, Footprint footprint, bool keep_opacity);

// Gauss-Legendre quadrature for analytic integrands over [0, 1], especially even ones.

struct QuadraturePoint {
    double x;       // in (0, 1)
    double weight;  // for the integral over [0, 1]
};

/// The positive half of the 64-point rule on [-1, 1]. For an integrand that is even about 0 and
/// analytic near [-1, 1], it is exact to rounding, even with poles at +-i/3.
std::span<const QuadraturePoint> even_quadrature();

/// Where an integral over a Gaussian's distance may end, standard deviations: only exp(-40) of the
/// mass is beyond.
constexpr double kGaussRadius = 9;

/// Integral of f over [0, 1] by the same rule with all its 64 points; f must be analytic.
template <class F>
double integrate_unit(F f) {
    double sum = 0;
    for (const auto [x, weight] : even_quadrature())
        sum += weight / 2 * (f((1 + x) / 2) + f((1 - x) / 2));
    return sum;
}

// What follows from a rendered profile alone, for kernels with tables and those in closed form:
// w(q) on [0, support], where the support is finite, or ends where a Gaussian is below rounding.

/// relocation_scale for this profile. radius: the square root of its support, or where a Gaussian
/// is below rounding.
double relocation_scale_of(const std::function<double(double)>& w, double support, double opacity,
                           int count);
/// gaussian_equivalent for a profile with this support, whose covariance is multiplied by `scale`.
GaussianEquivalent gaussian_equivalent_of(const std::function<double(double)>& w, double support,
                                          double scale, bool keep_opacity);

// How wide a kernel is in pictures, which merging needs to preserve the spread of splats.

/// The second moment per axis of the rendered profile over the plane, relative to the 2x2 block of
/// the 3D covariance: 1 for gaussian; with several pulses, that of the first. Takes about 0.1 ms.
double rendered_second_moment(int kernel, Footprint footprint);

}  // namespace darb
