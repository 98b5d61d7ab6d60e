#include "engine/raster/adam_step.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/core/error.h"
#include "engine/raster/gpu_splats.h"

namespace darb {

AdamStep adam_step(const AdamStep& rates, int t) {
    const auto correction1 = [](double beta1, int steps) { return 1.0 - std::pow(beta1, steps); };
    const auto correction2 = [](double beta2, int steps) {
        return std::sqrt(1.0 - std::pow(beta2, steps));
    };
    AdamStep step = rates;
    for (float& rate : step.rate) rate = static_cast<float>(rate / correction1(rates.beta1, t));
    step.inverse_sqrt_correction2 = static_cast<float>(1.0 / correction2(rates.beta2, t));
    if (rates.rest_every > 1) step.rest = t % rates.rest_every == 0 ? REST_APPLY : REST_GATHER;
    if (rates.rest_every > 1 || rates.rest_beta1 != rates.beta1 ||
        rates.rest_beta2 != rates.beta2) {
        const int steps = std::max(t / rates.rest_every, 1);
        step.rate[kShRest] =
            static_cast<float>(rates.rate[kShRest] / correction1(rates.rest_beta1, steps) *
                               correction2(rates.rest_beta2, steps) / correction2(rates.beta2, t));
    }
    return step;
}

void check_step(const AdamStep& step) {
    const auto check = [](const std::string& what, double value) {
        if (!(value >= 0) || !std::isfinite(value))
            throw Error("step of the optimiser", fmt::format("{} is {}", what, value),
                        "A number that is not negative is needed.");
    };
    for (int a = 0; a < kAttributeCount; ++a)
        check(fmt::format("the rate of {}", attribute_name(a)), step.rate[static_cast<size_t>(a)]);
    check("the correction of the second moment", step.inverse_sqrt_correction2);
    check("the weight of opacities", step.opacity_weight);
    check("the weight of scales", step.scale_weight);
    check("the clearance", step.clearance);
    check("1 - beta1", step.beta1 > 0 ? 1 - step.beta1 : step.beta1);
    check("1 - beta2", step.beta2 > 0 ? 1 - step.beta2 : step.beta2);
    check("1 - beta1 of harmonics", step.rest_beta1 > 0 ? 1 - step.rest_beta1 : step.rest_beta1);
    check("1 - beta2 of harmonics", step.rest_beta2 > 0 ? 1 - step.rest_beta2 : step.rest_beta2);
    check("the share of regularisers of what is not shown", step.regularise_unseen);
    check("the number of iterations between steps of harmonics", step.rest_every - 1);
    if (std::isnan(step.largest_log_scale)) check("the largest log scale", step.largest_log_scale);
}

void check_trainable(const GpuSplats& splats, const AdamStep& step) {
    if (!splats.has_moments())
        throw Error("step of the optimiser", "the splats hold no moments",
                    "Make GpuSplats with moments.");
    if (step.rest != REST_EACH && !splats.has_rest_sum())
        throw Error("step of the optimiser", "the splats hold no sum of harmonics' gradients",
                    "Make GpuSplats with it, or let harmonics step in every iteration.");
}

}  // namespace darb
