// SPDX-License-Identifier: MIT
// Compiled with -O3 -fopenmp-simd -fno-math-errno -fno-trapping-math (tools/CMakeLists.txt).
// The profiles are the twins of engine/kernels/kernel_coefficients.h without branches, so that four
// or more samples go through one instruction.
#include "tools/paper/sim1d_terms.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "engine/core/error.h"
#include "engine/kernels/kernel_profile.h"

namespace darb {

namespace {

constexpr double kHalfRange = 10;
constexpr double kGaussCut = 13;  // e^-84 is below the least normal float

struct Coefficients {
    float c[KERNEL_MAX_DEGREE + 1];
    float inverse_support, support;
};

/// 2^y for y in [-126, 126], to float rounding, by the Gaussian's own polynomial c.
template <int Degree>
inline float exp2_by(const float* c, float y) {
    constexpr float kRound = 12582912.0f;  // 1.5 * 2^23: adding it rounds to an integer
    const float n = (y + kRound) - kRound, f = y - n;
    float p = c[Degree];
    for (int k = Degree - 1; k >= 0; --k) p = p * f + c[k];
    const std::int32_t exponent = static_cast<std::int32_t>(n) + 127;
    return p * std::bit_cast<float>(exponent << 23);
}

/// log2 of a positive normal number, to 1e-7.
inline float log2_of(float v) {
    constexpr std::int32_t kRootHalf = 0x3f3504f3;
    const std::int32_t bits = std::bit_cast<std::int32_t>(v) - kRootHalf;
    const float mantissa = std::bit_cast<float>((bits & 0x7fffff) + kRootHalf);
    const float s = (mantissa - 1) / (mantissa + 1), s2 = s * s;
    const float series = 1 + s2 * (1.0f / 3 + s2 * (1.0f / 5 + s2 * (1.0f / 7 + s2 * (1.0f / 9))));
    return static_cast<float>(bits >> 23) + 2.88539008f * s * series;
}

/// u^Power P(x), x = t or t^2; Degree: of P, the unused coefficients are 0.
template <int Power, bool Squared, int Degree>
struct Compact {
    static inline void evaluate(const Coefficients& k, float q, float& w, float& slope) {
        const float t = std::min(q * k.inverse_support, 1.0f);
        const float x = Squared ? t * t : t;
        const float dx = Squared ? 2 * t * k.inverse_support : k.inverse_support;
        const float u = 1 - x;
        float p = k.c[Degree], dp = 0;
        float lower = u > 0 ? 1.0f : 0.0f;  // no slope beyond the edge, where u^0 would leave one
        for (int i = Degree - 1; i >= 0; --i) {
            dp = dp * x + p;
            p = p * x + k.c[i];
        }
        for (int i = 1; i < Power; ++i) lower *= u;
        w = Power == 0 ? lower * p : lower * u * p;
        slope = Power == 0 ? lower * dp * dx : lower * (u * dp - Power * p) * dx;
    }
};

template <int Degree>
struct Gaussian {
    static inline void evaluate(const Coefficients& k, float q, float& w, float& slope) {
        w = exp2_by<Degree>(k.c, std::max(q * -0.721347520f, -126.0f));
        slope = -0.5f * w;
    }
};

template <bool Quadratic>
struct Quadric {
    static inline void evaluate(const Coefficients& k, float q, float& w, float& slope) {
        const float inside = q < k.support ? 1.0f : 0.0f, v = 1 + q;
        const float value = Quadratic ? 1 / v : 1 / std::sqrt(v);
        w = inside * value;
        slope = Quadratic ? -w * value : -0.5f * w * value * value;
    }
};

/// Everything that a term contributes at its samples.
struct Rows {
    float *w, *slope_z, *sum;
};

template <class Profile>
void add_term_as(const Coefficients& k, const float* x, const Primitive1d& p, std::size_t first,
                 std::size_t last, const Rows& rows) {
    const float inverse = 1 / p.width, position = p.position, weight = p.weight;
    float *w_row = rows.w, *slope_row = rows.slope_z, *sum = rows.sum;
#pragma omp simd
    for (std::size_t s = first; s < last; ++s) {
        const float z = (x[s] - position) * inverse;
        float w, slope;
        Profile::evaluate(k, z * z, w, slope);
        w_row[s] = w;
        slope_row[s] = slope * z;
        sum[s] += weight * w;
    }
}

/// exp(-m), m = (q/2)^(b/2); by log shape -exp(-m) m ln(m).
void add_generalised(const Coefficients& k, const float* x, const Primitive1d& p, std::size_t first,
                     std::size_t last, const Rows& rows, float* by_shape) {
    constexpr float kLn2 = 0.693147181f;
    const float inverse = 1 / p.width, position = p.position, weight = p.weight;
    const float half_shape = 0.5f * p.shape;
    float *w_row = rows.w, *slope_row = rows.slope_z, *sum = rows.sum;
#pragma omp simd
    for (std::size_t s = first; s < last; ++s) {
        const float z = (x[s] - position) * inverse;
        const float half_q = std::max(0.5f * z * z, 1e-12f);
        const float log2_m =
            std::min(std::max(half_shape * log2_of(half_q), -100.0f), 6.44f);  // m up to 86.8
        const float m = exp2_by<5>(k.c, log2_m);
        const float w = exp2_by<5>(k.c, std::max(m * -1.442695041f, -126.0f));
        w_row[s] = w;
        slope_row[s] = -0.5f * w * m * half_shape / half_q * z;
        by_shape[s] = -w * m * log2_m * kLn2;
        sum[s] += weight * w;
    }
}

struct Sums {
    double weight = 0, position = 0, width = 0, shape = 0;
};

/// Rows of one primitive, [sample]; by_shape may be null.
struct SampleRows {
    const float *x, *residual, *w, *slope_z, *by_shape;
};

Sums dot_products(const SampleRows& rows, const Primitive1d& p, std::size_t first,
                  std::size_t last) {
    const float *x = rows.x, *residual = rows.residual, *w = rows.w;
    const float *slope_z = rows.slope_z, *by_shape = rows.by_shape;  // simd wants variables
    const float inverse = 1 / p.width, position = p.position;
    float a = 0, b = 0, c = 0, d = 0;
#pragma omp simd reduction(+ : a, b, c)
    for (std::size_t s = first; s < last; ++s) {
        const float z = (x[s] - position) * inverse, rs = residual[s] * slope_z[s];
        a += residual[s] * w[s];
        b += rs;
        c += rs * z;
    }
    if (by_shape != nullptr) {
#pragma omp simd reduction(+ : d)
        for (std::size_t s = first; s < last; ++s) d += residual[s] * by_shape[s];
    }
    return {a, b, c, d};
}

using AddTerm = void (*)(const Coefficients&, const float*, const Primitive1d&, std::size_t,
                         std::size_t, const Rows&);

template <int Power>
AddTerm compact_of(bool squared, int degree) {
    if (squared)
        return degree <= 5 ? add_term_as<Compact<Power, true, 5>>
                           : add_term_as<Compact<Power, true, KERNEL_MAX_DEGREE>>;
    return degree <= 5 ? add_term_as<Compact<Power, false, 5>>
                       : add_term_as<Compact<Power, false, KERNEL_MAX_DEGREE>>;
}

AddTerm term_of(const KernelCoefficients& k) {
    if (k.form == KERNEL_FORM_GAUSSIAN)
        return k.degree <= 5 ? add_term_as<Gaussian<5>> : add_term_as<Gaussian<KERNEL_MAX_DEGREE>>;
    if (k.form == KERNEL_FORM_QUADRIC)
        return k.half_power == 2 ? add_term_as<Quadric<true>> : add_term_as<Quadric<false>>;
    switch (k.half_power) {
        case 0:
            return compact_of<0>(k.squared, k.degree);
        case 2:
            return compact_of<1>(k.squared, k.degree);
        case 4:
            return compact_of<2>(k.squared, k.degree);
        case 6:
            return compact_of<3>(k.squared, k.degree);
        case 8:
            return compact_of<4>(k.squared, k.degree);
        default:
            break;
    }
    DARB_CHECK(false, "an edge of order {}/2 has no vectorised profile", k.half_power);
    return nullptr;
}

Coefficients floats_of(const KernelCoefficients& k) {
    Coefficients f{};
    for (int i = 0; i <= k.degree; ++i)
        f.c[i] = static_cast<float>(k.c[static_cast<std::size_t>(i)]);
    f.inverse_support = static_cast<float>(k.inverse_support);
    f.support = static_cast<float>(k.support);
    return f;
}

}  // namespace

std::vector<float> sample_points_1d(int samples) {
    std::vector<float> x;
    for (int i = 0; i < samples; ++i)
        x.push_back(static_cast<float>(kHalfRange * (2.0 * i / (samples - 1) - 1)));
    return x;
}

namespace {

// Kernels with shapes at their start, in the form of the others: beta is u^4 alone.
KernelCoefficients coefficients_1d(int kernel) {
    const bool starts_as_gaussian = kernel == kGeneralisedExponential ||
                                    kernel == KERNEL_GENERALIZED_EXPONENTIAL ||
                                    kernel == KERNEL_GES_PUBLISHED;
    KernelCoefficients k = kernel_coefficients(starts_as_gaussian ? KERNEL_GAUSSIAN : kernel,
                                               Footprint::psi, kFullDegree);
    if (k.form != KERNEL_FORM_BETA) return k;
    k.form = KERNEL_FORM_COMPACT;
    k.half_power = static_cast<int>(std::lround(2 * k.exponent));
    k.degree = 0;
    k.c = {1};
    return k;
}

}  // namespace

bool Terms1d::draws(int kernel) {
    const KernelCoefficients k = coefficients_1d(kernel);
    if (k.form != KERNEL_FORM_COMPACT)
        return k.form == KERNEL_FORM_GAUSSIAN || k.form == KERNEL_FORM_QUADRIC;
    return k.half_power % 2 == 0 && k.half_power <= 8;
}

Terms1d::Terms1d(int kernel, std::span<const float> target, std::size_t primitives)
    : kernel_(kernel),
      coefficients_(coefficients_1d(kernel)),
      radius_(std::min(kGaussCut, std::sqrt(coefficients_.support))),
      target_(target),
      x_(sample_points_1d(static_cast<int>(target.size()))),
      residual_(target.size()),
      w_(target.size() * primitives),
      slope_z_(w_.size()),
      by_shape_(kernel == kGeneralisedExponential ? w_.size() : 0) {
    if (kernel == kGeneralisedExponential) radius_ = std::numeric_limits<double>::infinity();
}

Terms1d::Reach Terms1d::reach_of(const Primitive1d& p) const {
    const double last = static_cast<double>(x_.size()) - 1, scale = last / (2 * kHalfRange);
    const double half = radius_ * p.width;
    const auto index = [&](double x) {
        return static_cast<std::size_t>(std::clamp(x * scale + last / 2, 0.0, last + 1));
    };
    // Rounded outwards by a sample: beyond the edge the profile is 0.
    return {index(p.position - half - 1 / scale), index(p.position + half + 2 / scale)};
}

void Terms1d::add_term(const Primitive1d& p, std::size_t i, const Reach& reach) {
    const std::size_t row = i * x_.size();
    const Rows rows{&w_[row], &slope_z_[row], residual_.data()};
    const Coefficients k = floats_of(coefficients_);
    if (kernel_ == kGeneralisedExponential)
        add_generalised(k, x_.data(), p, reach.first, reach.last, rows, &by_shape_[row]);
    else
        term_of(coefficients_)(k, x_.data(), p, reach.first, reach.last, rows);
}

double Terms1d::loss(std::span<const Primitive1d> primitives, std::vector<double>& gradient) {
    for (const Primitive1d& p : primitives)
        if (!std::isfinite(p.position) || !std::isfinite(p.width) || !std::isfinite(p.weight))
            return std::numeric_limits<double>::quiet_NaN();
    for (std::size_t s = 0; s < target_.size(); ++s) residual_[s] = -target_[s];
    for (std::size_t i = 0; i < primitives.size(); ++i)
        add_term(primitives[i], i, reach_of(primitives[i]));
    float squares = 0;
#pragma omp simd reduction(+ : squares)
    for (std::size_t s = 0; s < residual_.size(); ++s) squares += residual_[s] * residual_[s];
    const double samples = static_cast<double>(target_.size()), scale = 2 / samples;
    gradient.assign(primitives.size() * 4, 0.0);
    for (std::size_t i = 0; i < primitives.size(); ++i) {
        const Primitive1d& p = primitives[i];
        const Reach reach = reach_of(p);
        const std::size_t row = i * x_.size();
        const Sums sums = dot_products({x_.data(), residual_.data(), &w_[row], &slope_z_[row],
                                        by_shape_.empty() ? nullptr : &by_shape_[row]},
                                       p, reach.first, reach.last);
        gradient[i * 4] = scale * p.weight * sums.position * -2 / p.width;
        gradient[i * 4 + 1] = scale * p.weight * sums.width * -2;
        gradient[i * 4 + 2] = scale * sums.weight;
        gradient[i * 4 + 3] = scale * p.weight * sums.shape;
    }
    return squares / samples;
}

}  // namespace darb
