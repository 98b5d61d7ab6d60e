// SPDX-License-Identifier: MIT
// darb info X: what a splat scene or a data set holds.
#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "engine/core/count_text.h"
#include "engine/core/files.h"
#include "engine/core/quantile.h"
#include "engine/core/say.h"
#include "engine/core/text.h"
#include "engine/data/camera_list.h"
#include "engine/data/dataset.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/project_file.h"
#include "engine/scene/splat_file.h"
#include "engine/scene/stored_units.h"
#include "shaders/shared/limits.h"
#include "tools/darb/command_list.h"
#include "tools/darb/flags.h"
#include "tools/darb/outputs.h"
#include "trainer/job/scene_file.h"
#include "trainer/run/progress.h"

namespace darb {

/// info: from scene_info.
void print_scene_info(const nlohmann::json& info);
/// info: from dataset_info.
void print_dataset_info(const nlohmann::json& info);

// What `darb info` says about photos with cameras.

/// Opens a data set (only the headers of the photos) or a cameras.json. Keys: path, source, views,
/// train, test (as the source splits them), sizes [{width, height, views}] (px, as training takes
/// them), lenses [{model, width, height, views}] (as declared), points, extent (world units),
/// has_alpha, notes. Throws Error as load_dataset does.
nlohmann::json dataset_info(const std::filesystem::path& path, const DatasetOptions& options);

// What `darb info` says about a splat scene.

/// Reads any splat file. Keys: path, format, version (null where the format has none), details,
/// bytes, splats, dropped, notes (of the reader), kernel, footprint, render_mode, sh_degree,
/// origin; bounds and inner_bounds (1st to 99th percentile by axis) {low, high}, world; scale (the
/// largest standard deviation of a splat, world), opacity and, for a kernel with shapes, exponent
/// (as drawn) {p1, p10, p50, p90, p99}; metres_per_unit and place (on earth, a text) where they are
/// known; zero_rotations, huge, needles, saturated, invisible (counts); warnings (sentences).
/// Throws Error for other files. O(N).
nlohmann::json scene_info(const std::filesystem::path& path, const StoredUnits& units = {});

namespace {

struct InfoFlags {
    std::filesystem::path path, json;
    bool quiet = false;
    DatasetOptions data;
    StoredUnits units;
};

bool is_dataset(const std::filesystem::path& path) {
    if (scene_file_in(path)) return false;
    if (std::filesystem::is_directory(path)) return !std::filesystem::exists(path / "point_cloud");
    return has_extension(path, ".json") && !names_scene_folder(path) && !is_project_file(path);
}

int info(const InfoFlags& flags) {
    refuse_to_overwrite_inputs({flags.json}, files_of(flags.path));
    const bool dataset = is_dataset(flags.path);
    if (dataset && std::filesystem::is_regular_file(flags.json))
        refuse_to_overwrite_inputs({flags.json}, files_of(load_cameras(flags.path, flags.data)));
    const nlohmann::json facts = dataset ? dataset_info(flags.path, flags.data)
                                         : scene_info(find_scene(flags.path), flags.units);
    if (!flags.json.empty()) {
        nlohmann::json shared = facts;
        for (const char* texts : {"notes", "warnings"})
            if (shared.contains(texts)) leave_folders_out(shared[texts], flags.path);
        shared["path"] = name_in_json(flags.json, facts["path"].get<std::string>());
        write_json(flags.json, shared);
    }
    tell_paths(flags.quiet, {flags.json});
    if (flags.json != "-" && !flags.quiet)
        dataset ? print_dataset_info(facts) : print_scene_info(facts);
    return 0;
}

}  // namespace

void add_info(CLI::App& app, Action& action) {
    auto flags = std::make_shared<InfoFlags>();
    CLI::App* command = app.add_subcommand("info", "Describe a scene or a data set");
    command
        ->add_option("path", flags->path,
                     "splat file, output folder of darb train, data set, or cameras.json")
        ->required();
    add_json_option(*command, flags->json);
    command
        ->add_option("-i,--images", flags->data.images_folder, "photo folder of a COLMAP project")
        ->capture_default_str();
    command->add_option("-r,--resolution", flags->data.resolution,
                        "sizes as in training: 1, 2, 4, 8 or a width in px");
    add_quiet_flag(*command, flags->quiet);
    add_unit_options(*command, flags->units);
    command->callback([flags, &action] { action = [flags] { return info(*flags); }; });
}

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
    row("splats", count_text(info["splats"].get<size_t>()));
    row("kernel",
        fmt::format("{}, footprint {}, render mode {}", info["kernel"].get<std::string>(),
                    info["footprint"].get<std::string>(), info["render_mode"].get<std::string>()));
    row("SH degree", fmt::format("{}", info["sh_degree"].get<int>()));
    row("origin", vector_text(info["origin"]));
    if (info.contains("metres_per_unit"))
        row("unit", fmt::format("{:.6g} m", info["metres_per_unit"].get<double>()));
    if (info.contains("place")) row("on earth", info["place"].get<std::string>());
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

namespace {

using nlohmann::json;

// Opens a data set, or a camera list as a data set without photos and points.
Dataset open(const std::filesystem::path& path, const DatasetOptions& options) {
    const bool is_file = std::filesystem::is_regular_file(path);
    std::vector<View> views;
    if (is_file) views = load_cameras(path, options);
    if (views.empty() || !views[0].photo.empty()) return load_dataset(path, options);
    Dataset dataset;
    dataset.root = path;
    dataset.source = "cameras.json";
    dataset.views = std::move(views);
    return dataset;
}

json count_sizes(const Dataset& dataset) {
    std::map<std::pair<int, int>, size_t> counts;
    for (const View& view : dataset.views) ++counts[{view.camera.width, view.camera.height}];
    json list = json::array();
    for (const auto& [size, count] : counts)
        list.push_back({{"width", size.first}, {"height", size.second}, {"views", count}});
    return list;
}

json count_lenses(const Dataset& dataset) {
    std::map<std::tuple<std::string, int, int>, size_t> counts;
    for (const View& view : dataset.views)
        ++counts[{view.lens.model, view.lens.width, view.lens.height}];
    json list = json::array();
    for (const auto& [lens, count] : counts)
        list.push_back({{"model", std::get<0>(lens)},
                        {"width", std::get<1>(lens)},
                        {"height", std::get<2>(lens)},
                        {"views", count}});
    return list;
}

}  // namespace

json dataset_info(const std::filesystem::path& path, const DatasetOptions& options) {
    const Dataset dataset = open(path, options);
    const auto test = std::count_if(dataset.views.begin(), dataset.views.end(),
                                    [](const View& view) { return view.is_test; });
    return {{"path", path.string()},
            {"source", dataset.source},
            {"views", dataset.views.size()},
            {"train", dataset.views.size() - static_cast<size_t>(test)},
            {"test", test},
            {"sizes", count_sizes(dataset)},
            {"lenses", count_lenses(dataset)},
            {"points", dataset.points.size()},
            {"extent", scene_extent(dataset)},
            {"has_alpha", dataset.has_alpha},
            {"notes", dataset.notes}};
}

namespace {

using nlohmann::json;

// What counts as odd. A splat is huge where its standard deviation is above this share of the
// diagonal of the inner bounds, and a needle where its longest axis is so many times the second.
constexpr double kHugeShare = 0.5;
constexpr double kNeedleRatio = 100;
// a smaller share of needles or saturated splats is not mentioned
constexpr double kOddShare = 0.01;
constexpr double kSaturatedLogit = 17;  // the sigmoid is 1 in float32, its gradient 0

json percentiles(std::vector<double>& values) {
    json result;
    if (values.empty()) return result;
    for (const int p : {1, 10, 50, 90, 99})
        result[fmt::format("p{}", p)] = nearest_rank(values, p / 100.0);
    return result;
}

// The world positions by axis below which these shares of the splats lie.
json bounds(const SplatModel& model, double low, double high) {
    json result;
    std::vector<double> values(model.size());
    for (int axis = 0; axis < 3 && !values.empty(); ++axis) {
        for (size_t i = 0; i < values.size(); ++i)
            values[i] = model.origin[axis] + double{model.position[3 * i + axis]};
        result["low"].push_back(nearest_rank(values, low));
        result["high"].push_back(nearest_rank(values, high));
    }
    return result;
}

double diagonal(const json& bounds) {
    double square = 0;
    for (size_t axis = 0; axis < 3 && !bounds.is_null(); ++axis) {
        const double side = bounds["high"][axis].get<double>() - bounds["low"][axis].get<double>();
        square += side * side;
    }
    return std::sqrt(square);
}

// Adds the counts of odd splats, and the percentiles of scale and opacity.
void add_splats(const SplatModel& model, json& info) {
    const double huge_scale = kHugeShare * diagonal(info["inner_bounds"]);
    std::vector<double> scales, opacities, exponents;
    size_t zero_rotations = 0, huge = 0, needles = 0, saturated = 0, invisible = 0;
    for (size_t i = 0; i < model.size(); ++i) {
        std::array<double, 3> s{};
        for (size_t k = 0; k < 3; ++k) s[k] = std::exp(double{model.log_scale[3 * i + k]});
        std::sort(s.begin(), s.end());
        scales.push_back(s[2]);
        opacities.push_back(sigmoid(model.opacity_logit[i]));
        if (!model.shape.empty())
            exponents.push_back(
                splat_exponent(model.kernel, model.footprint, double{model.shape[i]}));
        zero_rotations += !has_rotation(model, i);
        huge += s[2] > huge_scale;
        needles += s[2] > kNeedleRatio * s[1];
        saturated += model.opacity_logit[i] > kSaturatedLogit;
        invisible += opacities.back() < ALPHA_CUTOFF_DEFAULT;
    }
    info["scale"] = percentiles(scales);
    info["opacity"] = percentiles(opacities);
    if (!exponents.empty()) info["exponent"] = percentiles(exponents);
    info["zero_rotations"] = zero_rotations;
    info["huge"] = huge;
    info["needles"] = needles;
    info["saturated"] = saturated;
    info["invisible"] = invisible;
}

void add_warnings(json& info) {
    json warnings = info["notes"];
    const double splats = std::max(1.0, info["splats"].get<double>());
    const auto warn = [&](const char* key, double least_share, const char* what) {
        const auto count = info[key].get<size_t>();
        if (count > 0 && static_cast<double>(count) >= least_share * splats)
            warnings.push_back(fmt::format("{} splats {}", count, what));
    };
    warn("dropped", 0, "have NaN or infinity and were dropped");
    warn("zero_rotations", 0, "have a rotation of length 0 and are not drawn");
    warn("huge", 0, "are larger than half of the scene");
    warn("needles", kOddShare, "are needles, over 100 times as long as wide");
    warn("saturated", kOddShare, "have an opacity of 1 that training could not lower");
    warn("invisible", kOddShare, "have an opacity below 1/255 and are not drawn");
    if (info["splats"] == 0) warnings.push_back("there are no splats");
    info["warnings"] = warnings;
}

}  // namespace

json scene_info(const std::filesystem::path& path, const StoredUnits& units) {
    SplatFile file;
    const bool project = is_project_file(path);
    const SplatModel model =
        project ? load_scene(path, &file, units) : load_splats(path, &file, units);
    if (project) file.details = "layers of a project together";
    json info = {{"path", path.string()},
                 {"format", format_name(file.format)},
                 {"version", file.version == 0 ? json() : json(file.version)},
                 {"details", file.details},
                 {"bytes", file.bytes},
                 {"splats", model.size()},
                 {"dropped", file.dropped},
                 {"notes", file.notes},
                 {"kernel", kernel_name(model.kernel)},
                 {"footprint", footprint_name(model.footprint)},
                 {"render_mode", model.antialias ? "mip" : "default"},
                 {"sh_degree", model.sh_degree},
                 {"origin", {model.origin.x, model.origin.y, model.origin.z}},
                 {"bounds", bounds(model, 0, 1)},
                 {"inner_bounds", bounds(model, 0.01, 0.99)}};
    if (model.metres_per_unit > 0) info["metres_per_unit"] = model.metres_per_unit;
    if (model.place.known()) info["place"] = place_summary(model.place);
    add_splats(model, info);
    add_warnings(info);
    return info;
}

}  // namespace darb
