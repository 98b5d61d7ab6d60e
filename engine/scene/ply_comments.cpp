#include "engine/scene/ply_comments.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include "engine/core/error.h"
#include "engine/core/text.h"
#include "engine/kernels/kernel_coefficients.h"
#include "engine/kernels/kernel_file.h"
#include "engine/kernels/kernel_registry.h"

namespace darb {

namespace {

/// Of "Key: value" or "Key value"; empty where the comment has another key.
std::string_view value_of(std::string_view comment, std::string_view key) {
    if (lower(comment.substr(0, key.size())) != lower(key)) return {};
    comment.remove_prefix(key.size());
    if (comment.empty() || (comment[0] != ':' && comment[0] != ' ')) return {};
    return comment.substr(std::min(comment.find_first_not_of(": \t"), comment.size()));
}

std::string_view last_value(const PlyHeader& header, std::string_view key) {
    std::string_view value;
    for (const std::string& comment : header.comments)
        if (const std::string_view one = value_of(comment, key); !one.empty()) value = one;
    return value;
}

int kernel_defined_by(std::string_view name, std::string_view function, const std::string& where,
                      std::vector<std::string>& notes) {
    const auto parsed = nlohmann::json::parse(function, nullptr, false);
    if (!parsed.is_object())
        throw Error(where, "its comment SplatKernelFunction is no JSON object", kCopyAgain);
    return register_kernel_of_file(
        definition_from_json({{"name", std::string(name)}, {"function", parsed}}, where), where,
        notes);
}

/// Of a kernel of one's own: what makes it here, and what draws it in a program that has no fit.
std::string function_comments(const SplatModel& model) {
    const KernelDefinition* definition = kernel_definition(model.kernel);
    if (definition == nullptr) return {};
    std::string lines = fmt::format("comment SplatKernelFunction: {}\n",
                                    definition_json(*definition)["function"].dump(
                                        -1, ' ', true, nlohmann::json::error_handler_t::replace));
    const KernelCoefficients& k = kernel_coefficients(model.kernel, model.footprint, kFullDegree);
    if (k.form != KERNEL_FORM_COMPACT) return lines;
    const std::string t = fmt::format("q / {}", k.support);
    lines += fmt::format("comment SplatKernelPolynomial: w = (1 - x)^{} P(x), x = {}, P",
                         0.5 * k.half_power, k.squared ? "(" + t + ")^2" : t);
    for (int i = 0; i <= k.degree; ++i)
        lines += fmt::format(" {}", static_cast<float>(k.c[static_cast<std::size_t>(i)]));
    return lines + "\n";
}

void read_render_mode(const PlyHeader& header, SplatModel& model, std::vector<std::string>& notes) {
    std::string mode = "default";
    for (const std::string& comment : header.comments) {
        const std::string_view named = value_of(comment, "SplatRenderMode");
        const std::string_view flag = value_of(comment, "antialiased");
        if (!named.empty()) mode = lower(named);
        if (flag == "0" || flag == "1") mode = flag == "1" ? "mip" : "default";
    }
    model.antialias = mode == "mip";
    if (mode != "mip" && mode != "default")
        notes.push_back(
            fmt::format("the SplatRenderMode '{}' is not known: drawn as default", mode));
}

}  // namespace

void read_ply_comments(const PlyHeader& header, const std::string& where, SplatModel& model,
                       std::vector<std::string>& notes) {
    if (const std::string_view name = last_value(header, "SplatKernel"); !name.empty()) {
        const std::string_view function = last_value(header, "SplatKernelFunction");
        const std::optional<int> kernel = function.empty()
                                              ? kernel_from_name(name)
                                              : kernel_defined_by(name, function, where, notes);
        if (!kernel)
            throw Error(where, fmt::format("names the unknown SplatKernel '{}'", name),
                        "darb train --help lists the kernels; correct or remove the comment.");
        model.kernel = *kernel;
    }
    if (const std::string_view name = last_value(header, "SplatFootprint"); !name.empty()) {
        const std::optional<Footprint> footprint = footprint_from_name(name);
        if (!footprint)
            throw Error(where, fmt::format("names the unknown SplatFootprint '{}'", name),
                        "psi and exact are known; correct or remove the comment.");
        model.footprint = *footprint;
    }
    if (model.footprint == Footprint::exact && !has_exact_footprint(model.kernel))
        throw Error(
            where,
            fmt::format("names SplatFootprint exact, which {} has not", kernel_name(model.kernel)),
            "Correct the comment to psi, or remove it.");
    read_render_mode(header, model, notes);
    if (stated_up(header) == "z")
        notes.emplace_back(
            "its comment 'Vertical axis: z' says what is up: darb view follows it, --up z of darb "
            "convert turns the scene");
}

std::string stated_up(const PlyHeader& header) {
    return lower(last_value(header, "Vertical axis")) == "z" ? "z" : "";
}

std::string ply_comments(const SplatModel& model) {
    return fmt::format(
        "comment SplatKernel: {}\ncomment SplatFootprint: {}\ncomment SplatRenderMode: {}\n{}",
        kernel_name(model.kernel), footprint_name(model.footprint),
        model.antialias ? "mip" : "default", function_comments(model));
}

}  // namespace darb
