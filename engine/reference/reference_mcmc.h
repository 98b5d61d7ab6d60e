// The strategy `mcmc` in double: weights, draws and places of a round of relocation, what a
// relocated splat becomes, and the noise on positions. Source: 3DGS-MCMC, arXiv 2404.09591, with
// the scale of any kernel (engine/kernels/relocation_table.h). Pure functions.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "engine/kernels/kernel_family.h"

namespace darb::reference {

/// The counter-based numbers of shaders/lib/random.glsl, bit by bit.
std::uint32_t random_hash(std::uint32_t value);
std::uint32_t random_seed(std::uint32_t seed, std::uint32_t index);
double random_uniform(std::uint32_t& state);  // in [0, 1), 24 bits

/// Integer weights [N]: opacity times scale rounded down, at least 1; 0 for the dead, whose opacity
/// is not above dead_opacity. opacity_logit: [N].
std::vector<std::uint32_t> relocation_weights(std::span<const float> opacity_logit,
                                              double dead_opacity, double scale);

struct RelocationPlan {
    std::vector<std::uint32_t> drawn;   // [draws] the splat of each
    std::vector<std::uint32_t> copies;  // [N] how often a splat was drawn
    struct Source {
        std::uint32_t splat;
        bool changed;  // false: stays as it was
        bool operator==(const Source&) const = default;
    };
    std::vector<Source> sources;  // [N + grown]
};
/// One draw for each dead splat (weight 0), in order, then one for each of `grown`. The sum of the
/// weights must not be 0 and fit 32 bits.
RelocationPlan relocation_plan(std::span<const std::uint32_t> weights, std::uint32_t grown,
                               std::uint32_t seed);

/// What each of count splats in the place of one gets: its logit, and what is added to its
/// log_scale. Opacities above ALPHA_MAX count as that; counts above RELOCATION_COUNTS likewise.
struct Relocated {
    double opacity_logit = 0;
    double log_factor = 0;
};
Relocated relocated(int kernel, Footprint footprint, float opacity_logit, std::uint32_t count);

/// rate * gate * covariance * normal, world units; rotation [4], log_scale [3], opacity_logit.
glm::dvec3 position_noise(const float* rotation, const float* log_scale, float opacity_logit,
                          double dead_opacity, double rate, std::uint32_t seed,
                          std::uint32_t index);

}  // namespace darb::reference
