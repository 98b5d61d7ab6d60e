// SPDX-License-Identifier: MIT
#include "engine/reference/reference_density_control.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/core/error.h"
#include "engine/kernels/relocation_table.h"
#include "engine/reference/projection.h"
#include "engine/scene/splat_model.h"
#include "shaders/shared/strategy_args.h"

namespace darb::reference {
namespace {

double largest_scale(const float* log_scale) {
    const float largest = std::max({log_scale[0], log_scale[1], log_scale[2]});
    return clamped_scale(static_cast<double>(largest));
}

double mean_gradient(double sum, std::uint32_t seen) {
    return seen > 0 ? sum / seen : 0.0;
}

/// Cancels growth down to the limit, smallest gradients first, and later splats before earlier
/// ones.
void limit_growth(std::span<const double> gradient, std::size_t max_splats,
                  std::vector<DensityAction>& actions) {
    std::vector<std::size_t> growing;
    for (std::size_t i = 0; i < actions.size(); ++i) {
        if (actions[i] == DensityAction::clone || actions[i] == DensityAction::split) {
            growing.push_back(i);
        }
    }
    const std::size_t total = count_after(actions);
    if (max_splats == 0 || total <= max_splats) {
        return;
    }
    const std::size_t excess = std::min(total - max_splats, growing.size());
    std::stable_sort(growing.begin(), growing.end(),
                     [&](std::size_t a, std::size_t b) { return gradient[a] > gradient[b]; });
    for (std::size_t k = growing.size() - excess; k < growing.size(); ++k) {
        actions[growing[k]] = DensityAction::keep;
    }
}

}  // namespace

std::vector<DensityAction> density_actions(std::span<const double> gradient_sum,
                                           std::span<const std::uint32_t> seen,
                                           std::span<const float> log_scale,
                                           std::span<const float> opacity_logit,
                                           const DensitySettings& settings) {
    const std::size_t n = opacity_logit.size();
    if (gradient_sum.size() != n || seen.size() != n || log_scale.size() != n * 3)
        throw Error("density control",
                    fmt::format("got {} splats, {} gradients, {} counts and {} scales", n,
                                gradient_sum.size(), seen.size(), log_scale.size()),
                    "Give one gradient, one count and three scales per splat.");
    std::vector<DensityAction> actions(n, DensityAction::keep);
    std::vector<double> gradient(n);
    for (std::size_t i = 0; i < n; ++i) {
        gradient[i] = mean_gradient(gradient_sum[i], seen[i]);
        const double scale = largest_scale(&log_scale[i * 3]);
        double scale_after = scale;
        if (gradient[i] >= settings.gradient_threshold) {
            const bool wide = scale > settings.split_scale_share * settings.scene_extent;
            actions[i] = wide ? DensityAction::split : DensityAction::clone;
            scale_after = wide ? scale / kSplitShrink : scale;
        }
        const bool too_wide =
            settings.prune_wide && scale_after > settings.max_scale_share * settings.scene_extent;
        if (too_wide || sigmoid(static_cast<double>(opacity_logit[i])) < settings.min_opacity) {
            actions[i] = DensityAction::remove;
        }
    }
    limit_growth(gradient, settings.max_splats, actions);
    return actions;
}

std::size_t count_after(std::span<const DensityAction> actions) {
    std::size_t count = 0;
    for (const DensityAction action : actions) {
        const bool grows = action == DensityAction::clone || action == DensityAction::split;
        count += action == DensityAction::remove ? 0 : grows ? 2 : 1;
    }
    return count;
}

glm::dvec3 split_offset(const float* rotation, const float* log_scale, const glm::dvec3& direction,
                        double radius) {
    const double q[4] = {rotation[0], rotation[1], rotation[2], rotation[3]};
    glm::dvec3 local = direction * radius;
    for (int c = 0; c < 3; ++c) {
        local[c] *= clamped_scale(static_cast<double>(log_scale[c]));
    }
    return rotation_terms(q).matrix * local;
}

float split_log_scale(float parent_log_scale) {
    return static_cast<float>(static_cast<double>(parent_log_scale) - std::log(kSplitShrink));
}

float reset_opacity(float logit) {
    const double limit = std::log(kResetOpacity / (1 - kResetOpacity));
    return static_cast<float>(std::min(static_cast<double>(logit), limit));
}

namespace {

constexpr double kGateSlope = 100;
constexpr double kTurn = 6.283185307179586;

}  // namespace

std::uint32_t random_hash(std::uint32_t value) {
    const std::uint32_t state = value * 747796405u + 2891336453u;
    const std::uint32_t word = ((state >> ((state >> 28) + 4u)) ^ state) * 277803737u;
    return (word >> 22) ^ word;
}

std::uint32_t random_seed(std::uint32_t seed, std::uint32_t index) {
    return random_hash(seed ^ random_hash(index));
}

double random_uniform(std::uint32_t& state) {
    state = random_hash(state);
    return (state >> 8) / 16777216.0;
}

std::vector<std::uint32_t> relocation_weights(std::span<const float> opacity_logit,
                                              double dead_opacity, double scale) {
    std::vector<std::uint32_t> weights;
    for (const float logit : opacity_logit) {
        const double o = sigmoid(static_cast<double>(logit));
        const bool lives = o > dead_opacity;
        weights.push_back(lives ? std::max(static_cast<std::uint32_t>(o * scale), 1u) : 0u);
    }
    return weights;
}

RelocationPlan relocation_plan(std::span<const std::uint32_t> weights, std::uint32_t grown,
                               std::uint32_t seed) {
    std::vector<std::uint64_t> ends(weights.size());  // inclusive sums
    std::inclusive_scan(weights.begin(), weights.end(), ends.begin(), std::plus<>(),
                        std::uint64_t{0});
    if (ends.empty() || ends.back() == 0 || ends.back() >= 1ull << 32)
        throw Error("relocation", fmt::format("{} weights", weights.size()),
                    "Their sum must be positive and fit 32 bits.");
    const auto dead = static_cast<std::uint32_t>(std::count(weights.begin(), weights.end(), 0u));
    RelocationPlan plan;
    plan.copies.assign(weights.size(), 0);
    for (std::uint32_t draw = 0; draw < dead + grown; ++draw) {
        const std::uint64_t at =
            (std::uint64_t{random_hash(random_seed(seed, draw))} * ends.back()) >> 32;
        const auto found = std::upper_bound(ends.begin(), ends.end(), at);
        plan.drawn.push_back(static_cast<std::uint32_t>(found - ends.begin()));
        ++plan.copies[plan.drawn.back()];
    }
    std::uint32_t next = 0;
    for (std::uint32_t i = 0; i < weights.size(); ++i) {
        const bool moved = weights[i] == 0;
        plan.sources.push_back({moved ? plan.drawn[next++] : i, moved || plan.copies[i] > 0});
    }
    while (next < plan.drawn.size()) plan.sources.push_back({plan.drawn[next++], true});
    return plan;
}

Relocated relocated(int kernel, Footprint footprint, float opacity_logit, std::uint32_t count) {
    const double before = std::min(sigmoid(static_cast<double>(opacity_logit)), double{ALPHA_MAX});
    const int n = static_cast<int>(std::min<std::uint32_t>(count, RELOCATION_COUNTS));
    const double after = relocation_opacity(before, n);
    return {std::log(after) - std::log1p(-after),
            std::log(relocation_scale(kernel, footprint, before, n))};
}

glm::dvec3 position_noise(const float* rotation, const float* log_scale, float opacity_logit,
                          double dead_opacity, double rate, std::uint32_t seed,
                          std::uint32_t index) {
    std::uint32_t state = random_seed(seed, index);
    double normal[4];
    for (int pair = 0; pair < 2; ++pair) {
        const double radius = std::sqrt(-2 * std::log(1 - random_uniform(state)));
        const double angle = kTurn * random_uniform(state);
        normal[2 * pair] = radius * std::cos(angle);
        normal[2 * pair + 1] = radius * std::sin(angle);
    }
    const double gate =
        sigmoid(-kGateSlope * (sigmoid(static_cast<double>(opacity_logit)) - dead_opacity));
    const double q[4] = {rotation[0], rotation[1], rotation[2], rotation[3]};
    const glm::dmat3 axes = rotation_terms(q).matrix;
    glm::dvec3 local = glm::transpose(axes) * glm::dvec3(normal[0], normal[1], normal[2]);
    for (int c = 0; c < 3; ++c) {
        const double s = clamped_scale(static_cast<double>(log_scale[c]));
        local[c] *= s * s;
    }
    return rate * gate * (axes * local);
}

template <class T>
void adam_step(std::span<T> parameter, std::span<const T> gradient, std::span<T> moment1,
               std::span<T> moment2, double learning_rate, int step, const AdamSettings& settings) {
    const size_t n = parameter.size();
    if (step < 1) throw Error("Adam", fmt::format("step {}", step), "Steps count from 1.");
    if (gradient.size() != n || moment1.size() != n || moment2.size() != n)
        throw Error("Adam",
                    fmt::format("{} parameters, {} gradients, moments {} and {}", n,
                                gradient.size(), moment1.size(), moment2.size()),
                    "All must have the same length.");
    const double bias1 = 1 - std::pow(settings.beta1, step);
    const double bias2 = 1 - std::pow(settings.beta2, step);
    for (size_t i = 0; i < n; ++i) {
        const double g = static_cast<double>(gradient[i]);
        const double m =
            settings.beta1 * static_cast<double>(moment1[i]) + (1 - settings.beta1) * g;
        const double v =
            settings.beta2 * static_cast<double>(moment2[i]) + (1 - settings.beta2) * g * g;
        moment1[i] = static_cast<T>(m);
        moment2[i] = static_cast<T>(v);
        const double move =
            learning_rate / bias1 * m / (std::sqrt(v) / std::sqrt(bias2) + settings.epsilon);
        parameter[i] = static_cast<T>(static_cast<double>(parameter[i]) - move);
    }
}

double decayed_learning_rate(double first, double last, int step, int steps) {
    const double share = steps > 0 ? std::clamp(double(step) / steps, 0.0, 1.0) : 1.0;
    return std::exp(std::log(first) * (1 - share) + std::log(last) * share);
}

template void adam_step(std::span<double>, std::span<const double>, std::span<double>,
                        std::span<double>, double, int, const AdamSettings&);
template void adam_step(std::span<float>, std::span<const float>, std::span<float>,
                        std::span<float>, double, int, const AdamSettings&);

}  // namespace darb::reference
