// SPDX-License-Identifier: MIT
// Adaptive density control of 3DGS (`--strategy adc`), as decisions on the host: which splats are
// cloned, split and removed, and what becomes of their parameters. Pure functions.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "engine/kernels/kernel_family.h"

namespace darb::reference {

enum class DensityAction : std::uint8_t {
    keep,
    clone,   // kept, and a copy appended
    split,   // replaced by two smaller children
    remove,  // too faint or too wide
};

struct DensitySettings {
    double gradient_threshold = 2e-4;  // mean screen gradient, NDC units; splats at or above it
                                       // grow
    double scene_extent = 1;           // world units
    double split_scale_share = 0.01;   // share of the extent: wider splats split, others are cloned
    double min_opacity = 0.005;
    bool prune_wide = false;       // set from iteration 3,000 on
    double max_scale_share = 0.1;  // share of the extent; used with prune_wide
    std::size_t max_splats = 0;    // growth stops here, largest gradients first; 0: no limit
};

constexpr double kSplitShrink = 1.6;  // a child's scale is its parent's divided by this
constexpr int kSplitChildren = 2;
constexpr double kResetOpacity = 0.01;

/// One action per splat. gradient_sum [N]: norms of the mean's gradient in NDC units, summed over
/// the steps that saw the splat; seen [N]: number of such steps. log_scale [N][3], opacity_logit
/// [N]. As in 3DGS, growth is decided first, then removal on the outcome: a splat that will split
/// is removed for its width only if its children would be.
std::vector<DensityAction> density_actions(std::span<const double> gradient_sum,
                                           std::span<const std::uint32_t> seen,
                                           std::span<const float> log_scale,
                                           std::span<const float> opacity_logit,
                                           const DensitySettings& settings);

/// The number of splats after the actions.
std::size_t count_after(std::span<const DensityAction> actions);

/// Offset of a child from its parent in world units: rotation * (scale * radius * direction), with
/// the parent's quaternion [4] (w x y z, any norm) and log_scale [3], a unit direction, and a
/// radius drawn with kernel_radius_quantile.
glm::dvec3 split_offset(const float* rotation, const float* log_scale, const glm::dvec3& direction,
                        double radius);
float split_log_scale(float parent_log_scale);

/// The logit of min(opacity, kResetOpacity).
float reset_opacity(float logit);

// The strategy `mcmc` in double: weights, draws and targets of a round of relocation, what a
// relocated splat becomes, and the noise on positions. Source: 3DGS-MCMC, arXiv 2404.09591, with
// the scale for any kernel (engine/kernels/relocation_table.h). Pure functions.

/// The counter-based random numbers of shaders/lib/random.glsl, bit for bit.
std::uint32_t random_hash(std::uint32_t value);
std::uint32_t random_seed(std::uint32_t seed, std::uint32_t index);
double random_uniform(std::uint32_t& state);  // in [0, 1), 24 bits

/// Integer weights [N]: opacity times scale rounded down, at least 1; 0 for dead splats, whose
/// opacity is at most dead_opacity. opacity_logit: [N].
std::vector<std::uint32_t> relocation_weights(std::span<const float> opacity_logit,
                                              double dead_opacity, double scale);

struct RelocationPlan {
    std::vector<std::uint32_t> drawn;   // [draws] index of each drawn splat
    std::vector<std::uint32_t> copies;  // [N] how often a splat was drawn
    struct Source {
        std::uint32_t splat;
        bool changed;  // false: stays as it was
        bool operator==(const Source&) const = default;
    };
    std::vector<Source> sources;  // [N + grown]
};
/// One draw for each dead splat (weight 0), in order, then one for each of `grown`. The sum of the
/// weights must be positive and fit 32 bits.
RelocationPlan relocation_plan(std::span<const std::uint32_t> weights, std::uint32_t grown,
                               std::uint32_t seed);

/// What each of `count` splats gets that replace one: its logit, and what is added to its
/// log_scale. Opacities are limited to ALPHA_MAX, counts to RELOCATION_COUNTS.
struct Relocated {
    double opacity_logit = 0;
    double log_factor = 0;
};
Relocated relocated(int kernel, Footprint footprint, float opacity_logit, std::uint32_t count);

/// rate * gate * covariance * normal, world units; rotation [4], log_scale [3], opacity_logit.
glm::dvec3 position_noise(const float* rotation, const float* log_scale, float opacity_logit,
                          double dead_opacity, double rate, std::uint32_t seed,
                          std::uint32_t index);

// Adam (Kingma and Ba 2015) as PyTorch computes it, dense: every parameter moves every step.

struct AdamSettings {
    double beta1 = 0.9;
    double beta2 = 0.999;
    double epsilon = 1e-15;
};

/// One step on n parameters; all spans have length n. step counts from 1 over the whole run. With v
/// = 0 and a zero gradient, nothing moves.
template <class T>
void adam_step(std::span<T> parameter, std::span<const T> gradient, std::span<T> moment1,
               std::span<T> moment2, double learning_rate, int step,
               const AdamSettings& settings = {});

/// Log-linear decay from first to last over `steps`; step in [0, steps], constant afterwards.
double decayed_learning_rate(double first, double last, int step, int steps);

}  // namespace darb::reference
