#include "engine/scene/ply_comments.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string_view>

#include "engine/core/error.h"
#include "engine/core/text.h"

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
        const std::optional<int> kernel = kernel_from_name(name);
        if (!kernel)
            throw Error(where, fmt::format("names the unknown SplatKernel '{}'", name),
                        "darb render --help lists the kernels; correct or remove the comment.");
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
    if (const std::string_view axis = last_value(header, "Vertical axis"); lower(axis) == "z")
        notes.push_back(
            fmt::format("its comment 'Vertical axis: {}' is not followed: --up z of "
                        "darb convert turns the scene",
                        axis));
}

std::string ply_comments(const SplatModel& model) {
    return fmt::format(
        "comment SplatKernel: {}\ncomment SplatFootprint: {}\ncomment SplatRenderMode: {}\n",
        kernel_name(model.kernel), footprint_name(model.footprint),
        model.antialias ? "mip" : "default");
}

}  // namespace darb
