#include "engine/reference/reference_density_control.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/core/error.h"
#include "engine/reference/projection_terms.h"
#include "engine/scene/splat_model.h"

namespace darb::reference {
namespace {

double largest_scale(const float* log_scale) {
    const float largest = std::max({log_scale[0], log_scale[1], log_scale[2]});
    return clamped_scale(static_cast<double>(largest));
}

double mean_gradient(double sum, std::uint32_t seen) {
    return seen > 0 ? sum / seen : 0.0;
}

/// Takes growth back, smallest gradients first and later splats before earlier, down to the cap.
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
                    fmt::format("{} splats, {} gradients, {} counts, {} scales", n,
                                gradient_sum.size(), seen.size(), log_scale.size()),
                    "Give one gradient, one count and three scales a splat.");
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

}  // namespace darb::reference
