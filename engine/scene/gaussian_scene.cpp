#include "engine/scene/gaussian_scene.h"

#include <algorithm>
#include <cmath>

namespace darb {

namespace {

constexpr double kMostOpacity = 0.999;

float scaled_logit(float logit, double factor) {
    const double opacity = std::min(factor / (1 + std::exp(-double{logit})), kMostOpacity);
    return static_cast<float>(std::log(opacity / (1 - opacity)));
}

}  // namespace

SplatModel as_gaussians(const SplatModel& model, bool keep_opacity, GaussianEquivalent* fit) {
    GaussianEquivalent nearest{1, 1, 0};
    SplatModel result = model;
    if (model.kernel != KERNEL_GAUSSIAN) {
        nearest = gaussian_equivalent(model.kernel, model.footprint, keep_opacity);
        const double grown = 0.5 * std::log(nearest.covariance);
        for (float& value : result.log_scale) value = static_cast<float>(value + grown);
        if (nearest.opacity != 1)
            for (float& value : result.opacity_logit) value = scaled_logit(value, nearest.opacity);
    }
    result.kernel = KERNEL_GAUSSIAN;
    result.footprint = Footprint::psi;
    if (fit) *fit = nearest;
    return result;
}

}  // namespace darb
