#include "tools/darb/info_text.h"

#include <fmt/format.h>

#include <string>

#include "engine/core/say.h"
#include "engine/core/text.h"
#include "trainer/run/progress.h"

namespace darb {

namespace {

using nlohmann::json;

void row(const char* label, const std::string& value) {
    tell("{:<13}{}\n", label, printable(value));
}

std::string vector_text(const json& v) {
    return fmt::format("{:.5g} {:.5g} {:.5g}", v[0].get<double>(), v[1].get<double>(),
                       v[2].get<double>());
}

std::string bounds_text(const json& b) {
    return b.is_null() ? "none" : vector_text(b["low"]) + "  to  " + vector_text(b["high"]);
}

std::string percentiles_text(const json& values) {
    std::string text;
    for (const char* p : {"p1", "p10", "p50", "p90", "p99"})
        if (!values.is_null())
            text +=
                fmt::format("{}{} {:.4g}", text.empty() ? "" : "  ", p, values[p].get<double>());
    return text.empty() ? "none" : text;
}

}  // namespace

void print_scene_info(const json& info) {
    row("scene", fmt::format("{}, {}", info["path"].get<std::string>(),
                             format_bytes(info["bytes"].get<double>())));
    const std::string details = info["details"].get<std::string>();
    row("format",
        info["format"].get<std::string>() +
            (info["version"].is_null() ? ""
                                       : fmt::format(" version {}", info["version"].get<int>())) +
            (details.empty() ? "" : " (" + details + ")"));
    row("splats", fmt::format("{}", info["splats"].get<size_t>()));
    row("kernel",
        fmt::format("{}, footprint {}, render mode {}", info["kernel"].get<std::string>(),
                    info["footprint"].get<std::string>(), info["render_mode"].get<std::string>()));
    row("SH degree", fmt::format("{}", info["sh_degree"].get<int>()));
    row("origin", vector_text(info["origin"]));
    row("bounds", bounds_text(info["bounds"]));
    row("98 % within", bounds_text(info["inner_bounds"]));
    row("scale", percentiles_text(info["scale"]));
    row("opacity", percentiles_text(info["opacity"]));
    if (info.contains("exponent")) row("exponent", percentiles_text(info["exponent"]));
    for (const json& warning : info["warnings"]) row("warning", warning.get<std::string>());
}

void print_dataset_info(const json& info) {
    const auto size = [](const json& of) {
        return fmt::format("{} x {} px", of["width"].get<int>(), of["height"].get<int>());
    };
    row("data set", info["path"].get<std::string>());
    row("source", info["source"].get<std::string>());
    row("views", fmt::format("{}{}", info["views"].get<size_t>(),
                             info["test"] == 0 ? ""
                                               : fmt::format(", of which its own split tests {}",
                                                             info["test"].get<size_t>())));
    for (const json& of : info["sizes"])
        row("size", fmt::format("{}, {} views", size(of), of["views"].get<size_t>()));
    for (const json& of : info["lenses"])
        row("lens", fmt::format("{}, {}, {} views", of["model"].get<std::string>(), size(of),
                                of["views"].get<size_t>()));
    row("points", fmt::format("{}", info["points"].get<size_t>()));
    row("extent", fmt::format("{:.4g}", info["extent"].get<double>()));
    if (info["has_alpha"].get<bool>()) row("alpha", "some photos have transparent parts");
    for (const json& note : info["notes"]) row("note", note.get<std::string>());
}

}  // namespace darb
