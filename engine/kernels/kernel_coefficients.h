// SPDX-License-Identifier: MIT
// The short polynomials that the shaders evaluate in float32, fitted in double to DerivedKernel.
// evaluate() is the CPU twin of shaders/kernels/*.glsl, in float or double.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "engine/kernels/kernel_profile.h"
#include "engine/kernels/shaped_kernel.h"

namespace darb {

/// Degrees that can be requested. kFullDegree means full accuracy: the shortest polynomial, of at
/// most KERNEL_MAX_DEGREE, whose error is below float32 rounding. Other degrees are taken
/// literally.
constexpr int kFullDegree = 5, kLeastDegree = 2;
constexpr double kShortAccuracy = 1e-2;

struct KernelCoefficients {
    int form = KERNEL_FORM_COMPACT;
    int degree = 0;
    bool modulus_of_sinc = false;  // rings: of sinc; else of raised cosine
    int half_power = 0;            // compact: 2a of u^a; quadric: 2e of (1+q)^-e, 1 or 2
    bool squared = false;          // x = t^2 rather than t; compact only
    bool line_integral = false;    // the exact footprint; quadric only
    double support = 0;            // R^2
    double exponent = 0;           // that of shape 0, for kernels with shapes
    double inverse_support = 0;    // 1/R^2 as the shaders have it: rounded up to float, so that the
                                   // edge q = R^2 gives u <= 0 with fused and unfused arithmetic
    // The polynomial's coefficients, rising powers. For rings: q at the peak and the end of each
    // pulse.
    std::array<double, KERNEL_MAX_DEGREE + 1> c{};
    double least_value = 0;  // smallest w where the shaders need not clamp it, or 0
    double value_error = 0;  // largest error of the fit in double; gaussian: relative
    double slope_error = 0;  // largest error of dw/dt (gaussian: dw/dq), t = q/R^2
};

/// degree: kLeastDegree..kFullDegree; ignored for rings, which are not polynomials. At every
/// degree, value(0) is 1, and kernels that fall to zero are exactly zero at the edge. For a kernel
/// given by a definition (KernelProfile::given), full accuracy is the best that can be reached, and
/// a lower degree is raised until the error is within kShortAccuracy. Takes milliseconds;
/// kernel_coefficients caches the results.
KernelCoefficients fit_coefficients(const DerivedKernel& kernel, Footprint footprint, int degree);
/// The polynomial in x = t that is best in float32; compact kernels only.
KernelCoefficients fit_plain(const DerivedKernel& kernel, Footprint footprint);
const KernelCoefficients& kernel_coefficients(int kernel, Footprint footprint, int degree);

/// The absolute error of w that float32 on any device may add to value_error. Multiplications and
/// additions are rounded correctly: 3e-7. Divisions and square roots are not: Vulkan allows 2.5 ulp
/// for a division, 2 for inversesqrt, and both for sqrt, so 7 for 1/sqrt(1+q), each 6e-8 below w =
/// 1. Terms that cancel leave the rounding of the largest; built-in kernels have none.
inline double float_rounding(const KernelCoefficients& k) {
    if (k.form == KERNEL_FORM_BETA) return beta_kernel().rounding(k.exponent);
    if (k.form == KERNEL_FORM_EXPONENTIAL) return exponential_kernel().rounding(k.exponent);
    const bool divides = k.form == KERNEL_FORM_QUADRIC;
    const bool compact = k.form == KERNEL_FORM_COMPACT;
    const bool has_root = compact && k.half_power % 2 == 1;
    double terms = 0;
    for (const double c : k.c) terms += compact ? std::abs(c) : 0;
    return std::max(3e-7, 6e-8 * terms) + (divides || has_root ? 6e-7 : 0);
}

/// w and dw/dq, as the shaders compute them with EVALUATION_POLYNOMIAL.
template <class Real>
void evaluate(const KernelCoefficients& k, Real q, Real& w, Real& slope);

/// P and dP/dx by Horner's scheme.
template <class Real>
void evaluate_polynomial(const KernelCoefficients& k, Real x, Real& p, Real& dp) {
    p = static_cast<Real>(k.c[static_cast<std::size_t>(k.degree)]);
    dp = 0;
    for (int i = k.degree - 1; i >= 0; --i) {
        dp = dp * x + p;
        p = p * x + static_cast<Real>(k.c[static_cast<std::size_t>(i)]);
    }
}

template <class Real>
void evaluate_compact(const KernelCoefficients& k, Real q, Real& w, Real& slope) {
    const Real t = std::min(q * static_cast<Real>(k.inverse_support), Real(1));
    const Real x = k.squared ? t * t : t;
    const Real dx = k.squared ? 2 * t * static_cast<Real>(k.inverse_support)
                              : static_cast<Real>(k.inverse_support);
    const Real u = 1 - x;
    Real lower = u > 0 ? Real(1) : Real(0);  // u^(a-1), or u^0 for a = 0
    if (k.half_power == 1) lower = u > 0 ? 1 / std::sqrt(u) : Real(0);
    if (k.half_power >= 2 && k.half_power % 2 == 1) lower *= std::sqrt(u);
    for (int power = 4; power <= k.half_power; power += 2) lower *= u;
    Real p, dp;
    evaluate_polynomial(k, x, p, dp);
    w = k.half_power == 0 ? lower * p : lower * u * p;
    slope = k.half_power == 0 ? lower * dp * dx
                              : lower * (u * dp - Real(0.5) * Real(k.half_power) * p) * dx;
}

template <class Real>
void evaluate_gaussian(const KernelCoefficients& k, Real q, Real& w, Real& slope) {
    const Real y = std::max(q * Real(-0.72134752044448170368), Real(-126));  // -log2(e)/2
    const Real n = std::nearbyint(y);
    Real p, dp;
    evaluate_polynomial(k, y - n, p, dp);
    w = std::ldexp(p, static_cast<int>(n));
    slope = k.degree < 5 ? Real(-0.72134752044448170368) * std::ldexp(dp, static_cast<int>(n))
                         : Real(-0.5) * w;
}

/// 2^y by the shaders' polynomial.
template <class Real>
Real power_of_two(const KernelCoefficients& k, Real y) {
    const Real above = std::max(y, Real(-126)), n = std::nearbyint(above);
    Real p, dp;
    evaluate_polynomial(k, above - n, p, dp);
    return std::ldexp(p, static_cast<int>(n));
}

/// As shaders/kernels/exponential.glsl, except for its logarithm.
template <class Real>
void evaluate_exponential(const KernelCoefficients& k, Real q, Real& w, Real& slope) {
    const Real half = Real(0.5) * static_cast<Real>(k.exponent);
    const Real v = std::min(q, Real(1e30)) + Real(EXPONENTIAL_SOFTENING);
    const Real p = power_of_two(k, std::min(half * std::log2(v), Real(7)));
    const Real first = power_of_two(k, half * Real(EXPONENTIAL_SOFTENING_LOG2));
    w = power_of_two(k, (p - first) * Real(-0.72134752044448170368));
    slope = Real(-0.5) * half * p / v * w;
}

/// u^e = 2^(e log2 u), as shaders/kernels/beta.glsl, except for its logarithm.
template <class Real>
void evaluate_beta(const KernelCoefficients& k, Real q, Real& w, Real& slope) {
    const Real t = std::min(q * static_cast<Real>(k.inverse_support), Real(1)), u = 1 - t;
    w = slope = 0;
    if (!(u > 0)) return;
    const Real exponent = static_cast<Real>(k.exponent);
    const Real y = std::max(exponent * std::log1p(-t) * Real(std::numbers::log2e), Real(-126));
    const Real n = std::nearbyint(y);
    Real p, dp;
    evaluate_polynomial(k, y - n, p, dp);
    w = std::ldexp(p, static_cast<int>(n));
    slope = -exponent * w / u * static_cast<Real>(k.inverse_support);
}

template <class Real>
void evaluate_quadric(const KernelCoefficients& k, Real q, Real& w, Real& slope) {
    const Real support = static_cast<Real>(k.support);
    const bool inside = q < support, quadratic = k.half_power == 2;
    const Real v = 1 + q;
    if (!k.line_integral) {
        w = quadratic ? 1 / v : 1 / std::sqrt(v);
        slope = quadratic ? -w * w : Real(-0.5) * w * w * w;
    } else {
        // x = sqrt(v/(1+R^2)), r = 1/x. Inverse quadratic: r acos x = r sqrt(u) P(x). Multiquadric:
        // acosh r = sqrt(h) P(r - 2), h = u r/(1+x), which is (r - 1) (1+R^2)/R^2 without
        // cancellation. The nearest singularity of P is at x or r = -1.
        const Real scale = static_cast<Real>(1 / (1 + k.support));
        const Real inverse_support = static_cast<Real>(k.inverse_support);
        const Real r = 1 / std::sqrt(v * scale), x = v * scale * r;
        const Real u = inside ? (support - q) * inverse_support : Real(1);
        const Real dx = Real(0.5) * scale * r, dr = -dx * r * r;  // derivatives by q
        Real p, dp;
        evaluate_polynomial(k, quadratic ? x : r - 2, p, dp);
        if (quadratic) {
            const Real root = std::sqrt(u);
            w = r * root * p;
            slope = root * (dr * p + r * dp * dx) - Real(0.5) * inverse_support * r * p / root;
        } else {
            const Real root = std::sqrt(u * r / (1 + x));
            w = root * p;
            slope = dr * (root * dp + Real(0.5) * p * (1 + inverse_support) / root);
        }
    }
    w = inside ? w : Real(0);
    slope = inside ? slope : Real(0);
}

/// Several pulses of 1/2 + 1/2 cos x or |sin x / x|, with x = pi sqrt(q / c1), c1 the first zero.
template <class Real>
void evaluate_rings(const KernelCoefficients& k, Real q, Real& w, Real& slope) {
    const bool inside = q < static_cast<Real>(k.support);
    const Real factor = static_cast<Real>(std::numbers::pi * std::numbers::pi / k.c[1]);  // x^2 / q
    const Real s = std::max(inside ? q * factor : Real(0), Real(1e-24)), x = std::sqrt(s);
    if (!k.modulus_of_sinc) {
        w = Real(0.5) + Real(0.5) * std::cos(x);
        slope = Real(-0.25) * std::sin(x) / x * factor;
    } else {
        w = std::sin(x) / x;
        slope = (std::cos(x) - w) / (2 * s);  // derivative of w by s
        if (s < Real(1)) {                    // its series, where that cancels
            slope = 0;
            Real term = Real(-1) / 6;
            for (int n = 1; n <= 9; ++n) {
                slope += static_cast<Real>(n) * term;
                term *= -s / static_cast<Real>((2 * n + 2) * (2 * n + 3));
            }
        }
        if (w < 0) {
            w = -w;
            slope = -slope;
        }
        slope *= factor;
    }
    w = inside ? w : Real(0);
    slope = inside ? slope : Real(0);
}

template <class Real>
void evaluate(const KernelCoefficients& k, Real q, Real& w, Real& slope) {
    if (k.form == KERNEL_FORM_COMPACT) {
        evaluate_compact(k, q, w, slope);
    } else if (k.form == KERNEL_FORM_GAUSSIAN || k.form == KERNEL_FORM_GES) {
        evaluate_gaussian(k, q, w, slope);
    } else if (k.form == KERNEL_FORM_BETA) {
        evaluate_beta(k, q, w, slope);
    } else if (k.form == KERNEL_FORM_EXPONENTIAL) {
        evaluate_exponential(k, q, w, slope);
    } else if (k.form == KERNEL_FORM_RINGS) {
        evaluate_rings(k, q, w, slope);
    } else {
        evaluate_quadric(k, q, w, slope);
    }
}

// Linear fits that minimise the largest error, for the shaders' polynomials.

/// Rows of a linear model: row i says sum_k basis[i][k] c[k] = target[i].
struct LinearRows {
    std::vector<std::vector<double>> basis;  // [rows][unknowns]
    std::vector<double> target;              // [rows]
    void add(std::vector<double> row, double value) {
        basis.push_back(std::move(row));
        target.push_back(value);
    }
};

/// The c [unknowns] with the least sum of squared errors; for a well-conditioned basis.
std::vector<double> least_squares_fit(const LinearRows& fitted);

/// The c [unknowns] with the least max_i |error of fitted row i|, where the exact rows hold
/// exactly. Lawson's iteratively reweighted least squares. Needs fitted rows, and more unknowns
/// than exact rows. Meant for polynomials: some 10 unknowns and 100 rows.
std::vector<double> minimax_fit(const LinearRows& fitted, const LinearRows& exact);

}  // namespace darb
