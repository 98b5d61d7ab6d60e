#include "engine/reference/reference_mcmc.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/core/error.h"
#include "engine/kernels/relocation_table.h"
#include "engine/reference/projection_terms.h"
#include "engine/scene/splat_model.h"
#include "shaders/shared/strategy_args.h"

namespace darb::reference {
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
                    "Their sum is positive and fits 32 bits.");
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

}  // namespace darb::reference
