// SPDX-License-Identifier: MIT
// One row per kernel: its name, its profile in double, its support and the order of its edge.
// Everything else (slope, reach, psi, exact footprint, radial density, shader coefficients) is
// derived from the row by DerivedKernel and kernel_coefficients.
#pragma once

#include <complex>
#include <functional>
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

}  // namespace darb
