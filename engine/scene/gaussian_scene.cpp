// SPDX-License-Identifier: MIT
#include "engine/scene/gaussian_scene.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/kernels/kernel_profile.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/scene/splat_shapes.h"
#include "shaders/shared/kernel_forms.h"

namespace darb {

namespace {

constexpr double kMostScaledOpacity = 0.999;

float scaled_logit(float logit, double factor) {
    const double opacity = std::min(factor / (1 + std::exp(-double{logit})), kMostScaledOpacity);
    return static_cast<float>(std::log(opacity / (1 - opacity)));
}

/// Converts each splat by its own shape, interpolating between fits at kFits shapes; returns the
/// means.
GaussianEquivalent convert_shapes(const SplatModel& model, bool keep_opacity, SplatModel& result) {
    constexpr int kFits = 64;
    const ShapedKernel& kernel = shaped_kernel(model.kernel);
    const bool is_gaussian =
        kernel_profile(model.kernel).form == KERNEL_FORM_GES;  // whose Gaussians have another size
    const double first = kernel.first_shape(), step = (kernel.last_shape() - first) / (kFits - 1);
    std::vector<GaussianEquivalent> fits;
    for (int k = 0; k < kFits; ++k)
        fits.push_back(kernel.gaussian(
            model.footprint, kernel.exponent(model.footprint, first + k * step), keep_opacity));
    GaussianEquivalent mean{0, 0, 0};
    double weights = 0;
    for (std::size_t i = 0; i < model.size(); ++i) {
        const double at = std::clamp((model.shape[i] - first) / step, 0.0, kFits - 1.0);
        const auto k = std::min(static_cast<std::size_t>(at), fits.size() - 2);
        const double part = at - static_cast<double>(k);
        const auto between = [&](double GaussianEquivalent::*of) {
            return fits[k].*of + part * (fits[k + 1].*of - fits[k].*of);
        };
        const double covariance =
            is_gaussian ? kernel.covariance_scale(model.footprint,
                                                  kernel.exponent(model.footprint, model.shape[i]))
                        : between(&GaussianEquivalent::covariance);
        const double opacity = between(&GaussianEquivalent::opacity);
        for (std::size_t c = 3 * i; c < 3 * i + 3; ++c)
            result.log_scale[c] =
                static_cast<float>(model.log_scale[c] + 0.5 * std::log(covariance));
        if (!keep_opacity) result.opacity_logit[i] = scaled_logit(model.opacity_logit[i], opacity);
        const double weight = sigmoid(model.opacity_logit[i]);
        weights += weight;
        mean.covariance += weight * covariance;
        mean.opacity += weight * opacity;
        mean.error += weight * between(&GaussianEquivalent::error);
    }
    if (!(weights > 0)) return {1, 1, 0};
    return {mean.covariance / weights, mean.opacity / weights, mean.error / weights};
}

}  // namespace

SplatModel as_gaussians(const SplatModel& model, bool keep_opacity, GaussianEquivalent* fit) {
    check_splat_shapes(model);
    GaussianEquivalent nearest{1, 1, 0};
    SplatModel result = model;
    if (kernel_has_shape(model.kernel)) {
        nearest = convert_shapes(model, keep_opacity, result);
    } else if (model.kernel != KERNEL_GAUSSIAN) {
        nearest = gaussian_equivalent(model.kernel, model.footprint, keep_opacity);
        const double grown = 0.5 * std::log(nearest.covariance);
        for (float& value : result.log_scale) value = static_cast<float>(value + grown);
        if (nearest.opacity != 1)
            for (float& value : result.opacity_logit) value = scaled_logit(value, nearest.opacity);
    }
    set_kernel(result, KERNEL_GAUSSIAN);
    result.footprint = Footprint::psi;
    if (fit) *fit = nearest;
    return result;
}

}  // namespace darb
