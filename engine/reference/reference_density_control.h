// Adaptive density control of 3DGS (`--strategy adc`), as decisions on the host: which splats are
// cloned, split and removed, and what becomes of their parameters. Pure functions.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

namespace darb::reference {

enum class DensityAction : std::uint8_t {
    keep,
    clone,   // kept, and a copy appended
    split,   // replaced by two smaller children
    remove,  // too faint or too wide
};

struct DensitySettings {
    double gradient_threshold = 2e-4;  // mean screen gradient, NDC units, at or above grows
    double scene_extent = 1;           // world units
    double split_scale_share = 0.01;   // of the extent: wider splats split, others clone
    double min_opacity = 0.005;
    bool prune_wide = false;       // from iteration 3,000 on
    double max_scale_share = 0.1;  // of the extent, where prune_wide
    std::size_t max_splats = 0;    // growth stops there, largest gradients first; 0: no cap
};

constexpr double kSplitShrink = 1.6;  // a child's scale is its parent's divided by it
constexpr int kSplitChildren = 2;
constexpr double kResetOpacity = 0.01;

/// One action a splat. gradient_sum [N]: norms of the mean's gradient in NDC units, summed over the
/// steps that saw the splat; seen [N]: how many did. log_scale [N][3], opacity_logit [N]. Growth
/// is decided first, then removal on the outcome, as 3DGS orders it: a splat to split is removed
/// for its width only where its children would be.
std::vector<DensityAction> density_actions(std::span<const double> gradient_sum,
                                           std::span<const std::uint32_t> seen,
                                           std::span<const float> log_scale,
                                           std::span<const float> opacity_logit,
                                           const DensitySettings& settings);

/// Splats after the actions.
std::size_t count_after(std::span<const DensityAction> actions);

/// Offset of a child from its parent in world units: rotation * (scale * radius * direction) with
/// the parent's quaternion [4] (w x y z, any norm) and log_scale [3], a unit direction, and a
/// radius drawn by kernel_radius_quantile.
glm::dvec3 split_offset(const float* rotation, const float* log_scale, const glm::dvec3& direction,
                        double radius);
float split_log_scale(float parent_log_scale);

/// The logit of min(opacity, kResetOpacity).
float reset_opacity(float logit);

}  // namespace darb::reference
