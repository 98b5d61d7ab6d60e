// SPDX-License-Identifier: MIT
#include "engine/kernels/learned_profile.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/core/error.h"
#include "engine/kernels/kernel_profile.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/kernels/shaped_kernel.h"

namespace darb {

namespace {

constexpr int kTerms = LearnedProfile::kWeights, kDegree = kTerms;
using Values = LearnedProfile::Values;

// A Gaussian has no edge; at this one it is 0.004, which is what a pixel shows at most.
constexpr double kGaussianEdge = 11;

/// F_j(u) and its derivative n B_{j-1,n-1}(u), for j = 1..n.
void partial_sums(double u, Values& value, Values& slope) {
    std::array<double, kDegree + 1> up{1}, down{1};  // powers of u and 1 - u
    for (int k = 1; k <= kDegree; ++k) {
        up[static_cast<std::size_t>(k)] = up[static_cast<std::size_t>(k) - 1] * u;
        down[static_cast<std::size_t>(k)] = down[static_cast<std::size_t>(k) - 1] * (1 - u);
    }
    double sum = 0, binomial = 1;  // C(n, j), from j = n down
    for (int j = kDegree; j >= 1; --j) {
        const auto at = static_cast<std::size_t>(j);
        sum += binomial * up[at] * down[kDegree - at];
        value[at - 1] = sum;
        slope[at - 1] = binomial * j * up[at - 1] * down[kDegree - at];
        binomial = binomial * j / (kDegree - j + 1);
    }
}

Values partial_sums(double u) {
    Values value, slope;
    partial_sums(u, value, slope);
    return value;
}

double dot(const Values& a, const Values& b) {
    double sum = 0;
    for (std::size_t j = 0; j < kTerms; ++j) sum += a[j] * b[j];
    return sum;
}

/// Integral of r^power F_j(1 - r^2) over [0, 1].
Values moments(int power) {
    Values sum{};
    for (const auto [r, weight] : even_quadrature()) {
        const Values f = partial_sums(1 - r * r);
        for (std::size_t j = 0; j < kTerms; ++j) sum[j] += weight * std::pow(r, power) * f[j];
    }
    return sum;
}

const Values& second_moments() {
    static const Values values = moments(2);
    return values;
}

const Values& fourth_moments() {
    static const Values values = moments(4);
    return values;
}

/// The line integrals of F_j, but for a factor of R: sqrt(u) integral F_j(u (1 - s^2)) ds over [0,
/// 1], and their derivatives.
void line_integrals(double u, Values& value, Values& slope) {
    value = slope = {};
    const double root = std::sqrt(u);
    for (const auto [s, weight] : even_quadrature()) {
        Values f, df;
        partial_sums(u * (1 - s * s), f, df);
        for (std::size_t j = 0; j < kTerms; ++j) {
            value[j] += weight * root * f[j];
            slope[j] += weight * (root * (1 - s * s) * df[j] + (u > 0 ? 0.5 * f[j] / root : 0));
        }
    }
}

/// The point of the simplex {p >= 0, sum p = 1} nearest to v.
Values on_simplex(const Values& v) {
    Values sorted = v;
    std::ranges::sort(sorted, std::greater<>());
    double sum = 0, shift = 0;
    for (std::size_t i = 0; i < kTerms; ++i) {
        sum += sorted[i];
        const double candidate = (sum - 1) / (static_cast<double>(i) + 1);
        if (sorted[i] > candidate) shift = candidate;
    }
    Values p;
    for (std::size_t i = 0; i < kTerms; ++i) p[i] = std::max(v[i] - shift, 0.0);
    return p;
}

}  // namespace

// Projected gradient with Nesterov's momentum: six unknowns, a millisecond.
Values nearest_weights(const std::function<double(double)>& f) {
    constexpr int kFitPoints = 200, kFitSteps = 5'000;
    std::array<Values, kTerms> matrix{};
    Values right{};
    for (int i = 0; i < kFitPoints; ++i) {
        const double u = (i + 0.5) / kFitPoints, target = f(u);
        const Values row = partial_sums(u);
        for (std::size_t j = 0; j < kTerms; ++j) {
            right[j] += row[j] * target;
            for (std::size_t k = 0; k < kTerms; ++k) matrix[j][k] += row[j] * row[k];
        }
    }
    double most = 0;  // bounds the largest eigenvalue
    for (const Values& row : matrix) {
        double sum = 0;
        for (const double m : row) sum += std::abs(m);
        most = std::max(most, sum);
    }
    Values p, y;
    p.fill(1.0 / kTerms);
    y = p;
    for (double t = 1, i = 0; i < kFitSteps; ++i) {
        Values down = y;
        for (std::size_t j = 0; j < kTerms; ++j) down[j] -= (dot(matrix[j], y) - right[j]) / most;
        const Values next = on_simplex(down);
        const double then = (1 + std::sqrt(1 + 4 * t * t)) / 2;
        for (std::size_t j = 0; j < kTerms; ++j) y[j] = next[j] + (t - 1) / then * (next[j] - p[j]);
        p = next;
        t = then;
    }
    return p;
}

std::string LearnedProfile::fault_of_start(int kernel) {
    if (kernel_has_shape(kernel)) return "each splat has a shape of its own already";
    if (kernel_pulses(kernel) > 1) return "it has several pulses, and so does not fall";
    return "";
}

LearnedProfile::LearnedProfile(int start) : start_(start), psi_(kernel_psi(start)) {
    if (const std::string fault = fault_of_start(start); !fault.empty())
        throw Error(std::string(kernel_name(start)), "cannot be learned: " + fault,
                    "Start from another kernel, such as gaussian.");
    const double edge =
        std::isfinite(kernel_support(start)) ? kernel_support(start) : kGaussianEdge;
    const Values nearest = nearest_weights(
        [&](double u) { return kernel_value(start, Footprint::psi, edge * (1 - u)); });
    for (std::size_t j = 0; j < kTerms; ++j)
        logits_[j] =
            static_cast<float>(std::log(kLeastWeight + (1 - kTerms * kLeastWeight) * nearest[j]));
}

Values LearnedProfile::weights() const {
    const double most = *std::ranges::max_element(logits_);
    Values p;
    double sum = 0;
    for (std::size_t j = 0; j < kTerms; ++j) sum += p[j] = std::exp(double(logits_[j]) - most);
    for (double& weight : p) weight /= sum;
    return p;
}

/// What the weights come to.
struct LearnedProfile::Parts {
    Values p{};
    double support = 0;
    Values log_support_by_p{};  // d ln R^2 / dp_j, with p free
    Values centre{};            // line integrals at u = 1
};

// psi = R^2 / 3 integral r^4 w / integral r^2 w, r in units of R.
LearnedProfile::Parts LearnedProfile::parts() const {
    Parts parts;
    parts.p = weights();
    const double fourth = dot(parts.p, fourth_moments()), second = dot(parts.p, second_moments());
    parts.support = 3 * psi_ * second / fourth;
    for (std::size_t j = 0; j < kTerms; ++j)
        parts.log_support_by_p[j] = second_moments()[j] / second - fourth_moments()[j] / fourth;
    Values slope;
    line_integrals(1, parts.centre, slope);
    return parts;
}

double LearnedProfile::support() const {
    return parts().support;
}

double LearnedProfile::drawn(const Parts& parts, Footprint footprint, double u) const {
    if (footprint == Footprint::psi) return dot(parts.p, partial_sums(u));
    Values value, slope;
    line_integrals(u, value, slope);
    return dot(parts.p, value) / dot(parts.p, parts.centre);
}

// With q held, u moves by (1 - u) d ln R^2. psi stays, so that q does.
Values LearnedProfile::slopes(const Parts& parts, Footprint footprint, double u) const {
    Values value, slope, by_p;
    if (footprint == Footprint::psi) {
        partial_sums(u, value, slope);
        const double by_u = dot(parts.p, slope);
        for (std::size_t j = 0; j < kTerms; ++j)
            by_p[j] = value[j] + by_u * (1 - u) * parts.log_support_by_p[j];
    } else {
        line_integrals(u, value, slope);
        const double centre = dot(parts.p, parts.centre), w = dot(parts.p, value) / centre;
        const double by_u = dot(parts.p, slope) / centre;
        for (std::size_t j = 0; j < kTerms; ++j)
            by_p[j] = (value[j] - w * parts.centre[j]) / centre +
                      by_u * (1 - u) * parts.log_support_by_p[j];
    }
    const double mean = dot(parts.p, by_p);  // of the softmax
    Values by_logit;
    for (std::size_t j = 0; j < kTerms; ++j) by_logit[j] = parts.p[j] * (by_p[j] - mean);
    return by_logit;
}

double LearnedProfile::value(Footprint footprint, double q) const {
    const Parts now = parts();
    return q < now.support ? drawn(now, footprint, 1 - q / now.support) : 0;
}

Values LearnedProfile::by_logits(Footprint footprint, double q) const {
    const Parts now = parts();
    return q < now.support ? slopes(now, footprint, 1 - q / now.support) : Values{};
}

// dw/d(logit) as a series of Chebyshev in sqrt(u). A line integral is sqrt(u) times a polynomial of
// u, and its slope ends in sqrt(u), as F_j begin with u.
Values LearnedProfile::gradient(Footprint footprint, std::span<const float> sums) const {
    DARB_CHECK(sums.size() == PROFILE_SUMS, "{} sums", sums.size());
    static_assert(PROFILE_SUMS == 2 * kDegree + 2);
    constexpr int kSumNodes = 32;
    const Parts now = parts();
    Values gradient{};
    for (int i = 0; i < kSumNodes; ++i) {
        const double angle = std::numbers::pi * (i + 0.5) / kSumNodes;
        const double root = (1 + std::cos(angle)) / 2;
        const Values at = slopes(now, footprint, root * root);
        double share = 0;  // of this node in the sum over terms
        for (std::size_t k = 0; k < PROFILE_SUMS; ++k)
            share += (k == 0 ? 1.0 : 2.0) / kSumNodes * std::cos(static_cast<double>(k) * angle) *
                     double(sums[k]);
        for (std::size_t j = 0; j < kTerms; ++j) gradient[j] += share * at[j];
    }
    return gradient;
}

KernelDefinition LearnedProfile::definition() const {
    const Parts now = parts();
    KernelDefinition d = define_kernel(
        "", now.support, [&](double q) { return drawn(now, Footprint::psi, 1 - q / now.support); },
        fmt::format("learned in training, from {}", kernel_name(start_)));
    constexpr std::string_view kDigest = "kernel_";
    DARB_CHECK(d.name.starts_with(kDigest), "{}", d.name);
    d.name = "learned_" + d.name.substr(kDigest.size());
    return d;
}

double LearnedProfile::distance_from_start() const {
    constexpr int kCompared = 1'000;
    const double of_start =
        std::isfinite(kernel_support(start_)) ? kernel_support(start_) : kGaussianEdge;
    const double end = std::max(support(), of_start);
    double largest = 0;
    for (int i = 0; i < kCompared; ++i) {
        const double q = end * i / kCompared;
        largest = std::max(
            largest, std::abs(value(Footprint::psi, q) - kernel_value(start_, Footprint::psi, q)));
    }
    return largest;
}

ProfileOptimizer::ProfileOptimizer(int start, Footprint footprint, double rate)
    : footprint_(footprint),
      rate_(rate),
      profile_(start),
      kernel_(register_kernel(profile_.definition())) {}

// A run makes some tens of steps, so the mean square is over the last ten or so.
void ProfileOptimizer::step(std::span<const float> sums) {
    constexpr double kBeta1 = 0.8, kBeta2 = 0.9, kEpsilon = 1e-20;
    const Values g = profile_.gradient(footprint_, sums);
    const auto is_zero = [](double d) { return d == 0; };
    if (!std::ranges::all_of(g, [](double d) { return std::isfinite(d); })) return;
    if (std::ranges::all_of(g, is_zero)) return;
    ++steps_;
    std::array<float, kTerms> logits = profile_.logits();
    for (std::size_t j = 0; j < kTerms; ++j) {
        first_[j] = static_cast<float>(kBeta1 * first_[j] + (1 - kBeta1) * g[j]);
        second_[j] = static_cast<float>(kBeta2 * second_[j] + (1 - kBeta2) * g[j] * g[j]);
        const double mean = first_[j] / (1 - std::pow(kBeta1, steps_));
        const double square = second_[j] / (1 - std::pow(kBeta2, steps_));
        logits[j] -= static_cast<float>(rate_ * mean / (std::sqrt(square) + kEpsilon));
    }
    // Only their differences count. Below a millionth of the largest a weight shows nowhere.
    const float most = *std::ranges::max_element(logits);
    for (float& logit : logits) logit = std::max(logit - most, -14.0f);
    profile_.set_logits(logits);
    kernel_ = register_kernel(profile_.definition());
}

std::vector<float> ProfileOptimizer::state() const {
    std::vector<float> state(profile_.logits().begin(), profile_.logits().end());
    state.insert(state.end(), first_.begin(), first_.end());
    state.insert(state.end(), second_.begin(), second_.end());
    state.push_back(static_cast<float>(steps_));
    return state;
}

void ProfileOptimizer::restore(const std::vector<float>& state) {
    const bool finite = std::ranges::all_of(state, [](float v) { return std::isfinite(v); });
    if (state.size() != kStateFloats || !finite || state.back() < 0 || state.back() > 1e6f)
        throw Error("training state", "its profile is not one of a kernel that is learned",
                    "Restore what state() gave.");
    std::array<float, kTerms> logits;
    const auto at = [&](int part) { return state.begin() + part * kTerms; };
    std::copy_n(at(0), kTerms, logits.begin());
    std::copy_n(at(1), kTerms, first_.begin());
    std::copy_n(at(2), kTerms, second_.begin());
    steps_ = static_cast<int>(state.back());
    profile_.set_logits(logits);
    kernel_ = register_kernel(profile_.definition());
}

}  // namespace darb
