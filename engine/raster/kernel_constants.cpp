// SPDX-License-Identifier: MIT
#include "engine/raster/kernel_constants.h"

#include <fmt/format.h>
#include <cmath>
#include <string>
#include <utility>

#include "engine/core/error.h"
#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/kernels/kernel_profile.h"
#include "engine/kernels/shaped_kernel.h"
#include "shaders/shared/kernel_probe_args.h"

namespace darb {
namespace {

constexpr float kUnbounded = 3e38f;  // R^2 of the Gaussian
// How much the computed w may stray, relative to w, from the one that bounded the splat: rounding
// that differs between passes; the built-in functions; and the error of the Gaussian's polynomial,
// whose reach is the closed form's.
constexpr double kRoundingMargin = 1e-6, kBuiltinMargin = 1e-4;

constexpr ConstantName kCoefficients[] = {"KERNEL_C0", "KERNEL_C1", "KERNEL_C2",
                                          "KERNEL_C3", "KERNEL_C4", "KERNEL_C5",
                                          "KERNEL_C6", "KERNEL_C7", "KERNEL_C8"};

/// The name of a constant of a blend's second kernel, and that of the same constant of the first.
struct NameInBlend {
    ConstantName second, first;
};
constexpr NameInBlend kNamesInBlend[] = {
    {"BLEND_FORM", "KERNEL_FORM"},
    {"BLEND_DEGREE", "KERNEL_DEGREE"},
    {"BLEND_HALF_POWER", "KERNEL_HALF_POWER"},
    {"BLEND_SQUARED_VARIABLE", "KERNEL_SQUARED_VARIABLE"},
    {"BLEND_SUPPORT", "KERNEL_SUPPORT"},
    {"BLEND_INVERSE_SUPPORT", "KERNEL_INVERSE_SUPPORT"},
    {"BLEND_C0", "KERNEL_C0"},
    {"BLEND_C1", "KERNEL_C1"},
    {"BLEND_C2", "KERNEL_C2"},
    {"BLEND_C3", "KERNEL_C3"},
    {"BLEND_C4", "KERNEL_C4"},
    {"BLEND_C5", "KERNEL_C5"},
    {"BLEND_C6", "KERNEL_C6"},
    {"BLEND_C7", "KERNEL_C7"},
    {"BLEND_C8", "KERNEL_C8"},
};

/// Those of the first kernel, and what shaders/kernels/blend.glsl wants of the second.
SpecConstants blend_constants(int kernel, Footprint footprint, int degree, float alpha_cutoff) {
    const auto [first, second] = *blend_parts(kernel);
    const auto of = [&](int k) {
        return kernel_constants(k, footprint, EVALUATION_POLYNOMIAL, degree, alpha_cutoff);
    };
    SpecConstants constants = of(first);
    const SpecConstants other = of(second);
    for (const NameInBlend& name : kNamesInBlend) constants[name.second] = other.at(name.first);
    const BlendFacts& facts = blend_facts(kernel);
    const auto put = [&](ConstantName name, double value) {
        constants[name] = static_cast<float>(value);
    };
    put("BLEND_CENTRE_RATIO", facts.centre[1] / facts.centre[0]);
    put("BLEND_FOURTH_1", facts.fourth[0]);
    put("BLEND_FOURTH_2", facts.fourth[1]);
    put("BLEND_SECOND_1", facts.second[0]);
    put("BLEND_SECOND_2", facts.second[1]);
    constants["BLENDED"] = 1;
    constants["KERNEL_REACH_MARGIN"] = static_cast<float>(kBuiltinMargin);
    return for_several_passes(std::move(constants));
}

}  // namespace

SpecConstants kernel_constants(int kernel, Footprint footprint, int evaluation, int degree,
                               float alpha_cutoff) {
    if (evaluation != EVALUATION_POLYNOMIAL && evaluation != EVALUATION_BUILTIN)
        throw Error("kernel", fmt::format("no evaluation {}", evaluation),
                    "Use one of shaders/shared/accuracy_list.h.");
    if (!(alpha_cutoff > 0 && alpha_cutoff < 1))
        throw Error("kernel", fmt::format("an alpha cutoff of {}", alpha_cutoff),
                    "Use one between 0 and 1.");
    if (footprint == Footprint::exact && !has_exact_footprint(kernel))
        throw Error(std::string(kernel_name(kernel)), "has no exact footprint",
                    "Use the footprint psi.");
    if (blend_parts(kernel)) return blend_constants(kernel, footprint, degree, alpha_cutoff);
    const KernelCoefficients& k = kernel_coefficients(kernel, footprint, degree);
    if (k.form == KERNEL_FORM_RINGS) evaluation = EVALUATION_BUILTIN;
    double margin = evaluation == EVALUATION_BUILTIN ? kBuiltinMargin : kRoundingMargin;
    const bool shaped = kernel_has_shape(kernel);
    if (shaped) margin = kBuiltinMargin;  // for log2 and exp2 in the reach
    // The exponential's power goes through the polynomial twice: its error is that of ln w, times
    // it.
    const double passes = k.form == KERNEL_FORM_EXPONENTIAL ? 2 - std::log(alpha_cutoff) : 1.5;
    if (k.form == KERNEL_FORM_GAUSSIAN || shaped) margin += passes * k.value_error;
    DARB_CHECK(k.half_power <= 9, "half_power = {}", k.half_power);  // shaders/kernels/compact.glsl
    SpecConstants constants{
        {"KERNEL", shader_kernel(kernel)},
        {"KERNEL_PULSES", kernel_pulses(kernel)},
        {"FOOTPRINT", static_cast<int>(footprint)},
        {"EVALUATION", evaluation},
        {"KERNEL_FORM", k.form},
        {"KERNEL_DEGREE", k.degree},
        {"KERNEL_HALF_POWER", k.half_power},
        {"KERNEL_SQUARED_VARIABLE", k.squared ? 1 : 0},
        {"KERNEL_SUPPORT", std::isfinite(k.support) ? static_cast<float>(k.support) : kUnbounded},
        {"KERNEL_INVERSE_SUPPORT", static_cast<float>(k.inverse_support)},
        {"COVARIANCE_SCALE", static_cast<float>(covariance_scale(kernel, footprint))},
        {"ALPHA_CUTOFF", alpha_cutoff},
        {"KERNEL_REACH_MARGIN", static_cast<float>(margin)},
    };
    for (std::size_t i = 0; i < k.c.size(); ++i)
        constants[kCoefficients[i]] = static_cast<float>(k.c[i]);
    return for_several_passes(std::move(constants));
}

std::vector<KernelAnswer> probe_kernel(Device& device, const SpecConstants& constants,
                                       const std::vector<KernelProbe>& probes, float exponent) {
    const Pipeline pipeline(device, "kernel_probe", constants);
    Buffer input(device, "probes", probes.size() * sizeof(KernelProbe));
    Buffer output(device, "answers", probes.size() * sizeof(KernelAnswer));
    input.upload(probes);
    Commands commands(device);
    commands.begin();
    const auto count = static_cast<std::uint32_t>(probes.size());
    commands.dispatch(pipeline, gpu::KernelProbeArgs{count, exponent}, {input, output},
                      (count + KERNEL_PROBE_GROUP - 1) / KERNEL_PROBE_GROUP);
    commands.submit_and_wait();
    return output.download<KernelAnswer>(probes.size());
}

}  // namespace darb
