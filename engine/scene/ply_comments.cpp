#include "engine/scene/ply_comments.h"

#include <fmt/format.h>

#include <optional>
#include <string_view>

#include "engine/core/error.h"

namespace darb {

namespace {

/// "Key: value" or "Key value".
std::string_view comment_value(const PlyHeader& header, std::string_view key) {
    for (const std::string& comment : header.comments) {
        std::string_view text = comment;
        if (!text.starts_with(key)) continue;
        text.remove_prefix(key.size());
        if (text.empty() || (text[0] != ':' && text[0] != ' ')) continue;
        const std::size_t begin = text.find_first_not_of(": \t");
        return begin == std::string_view::npos ? std::string_view{} : text.substr(begin);
    }
    return {};
}

}  // namespace

void read_ply_comments(const PlyHeader& header, const std::string& where, SplatModel& model) {
    if (const std::string_view name = comment_value(header, "SplatKernel"); !name.empty()) {
        const std::optional<int> kernel = kernel_from_name(name);
        if (!kernel)
            throw Error(where, fmt::format("names the unknown SplatKernel '{}'", name),
                        "darb render --help lists the kernels; correct or remove the comment.");
        model.kernel = *kernel;
    }
    if (const std::string_view name = comment_value(header, "SplatFootprint"); !name.empty()) {
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
    model.antialias = comment_value(header, "SplatRenderMode") == "mip";
}

std::string ply_comments(const SplatModel& model) {
    return fmt::format(
        "comment SplatKernel: {}\ncomment SplatFootprint: {}\ncomment SplatRenderMode: {}\n",
        kernel_name(model.kernel), footprint_name(model.footprint),
        model.antialias ? "mip" : "default");
}

}  // namespace darb
