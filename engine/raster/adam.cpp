// SPDX-License-Identifier: MIT
#include "engine/raster/adam.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "engine/core/error.h"
#include "engine/primitives/groups.h"
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
    check("the weight of flatness", step.flatness_weight);
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

namespace {

float weight_of(const AdamStep& step, int rule, std::uint32_t splats) {
    const auto n = static_cast<float>(splats + step.splats_gone);
    if (rule == STEP_OPACITY) return step.opacity_weight / n;
    return rule == STEP_SCALE ? step.scale_weight / (3.0f * n) : 0.0f;
}

}  // namespace

AdamUpdate::AdamUpdate(Device& device)
    : device_(&device),
      fade_(device, "fade_near", {{"THREADS", SPLAT_GROUP}}),
      add_views_(device, "add_views", {{"THREADS", SPLAT_GROUP}}) {}

const Pipeline& AdamUpdate::pipeline(int attribute, std::uint32_t floats, int rest, bool flatness) {
    const std::array<int, 4> key{attribute, static_cast<int>(floats), rest, flatness ? 1 : 0};
    const auto found = pipelines_.find(key);
    if (found != pipelines_.end()) return found->second;
    const SpecConstants constants{
        {"THREADS", SPLAT_GROUP},
        {"FLOATS", static_cast<std::int32_t>(floats)},
        {"STEP", kSplatAttributes[static_cast<std::size_t>(attribute)].step},
        {"REST", rest},
        {"FLATNESS", flatness ? 1 : 0}};
    return pipelines_.emplace(key, Pipeline(*device_, "adam_update", constants)).first->second;
}

void AdamUpdate::record(Commands& commands, GpuSplats& splats, const GradientBuffers& gradients,
                        const Buffer& status, int sh_degree, const AdamStep& step, float scale) {
    check_step(step);
    check_trainable(splats, step);
    if (!std::isfinite(scale))
        throw Error("step of the optimiser", fmt::format("the gradients' scale is {}", scale),
                    "Give a finite number.");
    if (gradients.count() != splats.count())
        throw Error("step of the optimiser",
                    fmt::format("{} splats, gradients of {}", splats.count(), gradients.count()),
                    "Make the gradients' buffers anew where splats come or go.");
    commands.pass("adam");
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::uint32_t floats = splats.stride(a);
        gpu::AdamUpdateArgs args{};
        const int rule = kSplatAttributes[static_cast<std::size_t>(a)].step;
        args.floats_in_use = rule == STEP_REST ? attribute_floats(a, sh_degree) : floats;
        if (args.floats_in_use == 0) continue;
        args.rate = step.rate[static_cast<std::size_t>(a)];
        args.inverse_sqrt_correction2 = step.inverse_sqrt_correction2;
        const double beta1 = rule == STEP_REST ? step.rest_beta1 : step.beta1;
        const double beta2 = rule == STEP_REST ? step.rest_beta2 : step.beta2;
        args.beta1 = static_cast<float>(beta1);
        args.share1 = static_cast<float>(1.0 - beta1);
        args.beta2 = static_cast<float>(beta2);
        args.share2 = static_cast<float>(1.0 - beta2);
        args.gradient_scale = scale;
        args.weight = weight_of(step, rule, splats.count());
        const bool flatness = rule == STEP_SCALE && step.flatness_weight > 0;
        if (flatness)
            args.flatness_weight =
                step.flatness_weight / static_cast<float>(splats.count() + step.splats_gone);
        args.regularise_unseen = step.regularise_unseen;
        args.largest = step.largest_log_scale;
        args.rest_share = 1.0f / static_cast<float>(step.rest_every);
        const int rest = rule == STEP_REST ? step.rest : REST_EACH;
        for (const SplatRange& range : splats.trained_ranges()) {
            args.first_splat = range.first;
            args.splat_count = range.count;
            const AttributeRows rows = splats.rows(a);
            const BufferRange gradient = range_of_rows(gradients.of(a), rows, range);
            const std::uint64_t held = rows.rows_held(range.count);
            const Groups g = groups_for(held * (rows.columns > 0 ? rows.columns
                                                : flatness       ? 1
                                                                 : floats));
            commands.dispatch(
                pipeline(a, floats, rest, flatness), args,
                {range_of_rows(splats.parameters(a), rows, range),
                 range_of_rows(splats.moments(a), splats.rows(a, 2), range), gradient,
                 gradients.views(), rest == REST_EACH ? gradient : splats.rest_sum(range), status},
                g.x, g.y);
        }
    }
}

void AdamUpdate::record_fading(Commands& commands, GpuSplats& splats,
                               const GradientBuffers& gradients, const Buffer& status,
                               const FrameView& view, float clearance) {
    const std::uint32_t n = splats.trained_count();
    if (!(clearance > 0) || n == 0) return;
    const Groups g = groups_for(n);
    commands.pass("adam");
    commands.dispatch(fade_, gpu::FadeNearArgs{n, view.index, clearance},
                      {*view.cameras, splats.trained(splats.parameters(kPosition), 3),
                       splats.trained(splats.parameters(kOpacityLogit), 1),
                       splats.trained(gradients.views(), 2), status},
                      g.x, g.y);
}

void AdamUpdate::record_sums(Commands& commands, const GradientBuffers& gradients,
                             const Buffer& status, const Buffer& gradient_sum) {
    if (gradients.count() == 0) return;
    const Groups g = groups_for(gradients.count());
    commands.pass("adam");
    commands.dispatch(add_views_, gpu::SplatArgs{gradients.count()},
                      {gradients.views(), gradient_sum, status}, g.x, g.y);
}

}  // namespace darb
