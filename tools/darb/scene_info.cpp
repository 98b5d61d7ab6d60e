#include "tools/darb/scene_info.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "engine/core/quantile.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_file.h"
#include "shaders/shared/limits.h"

namespace darb {

namespace {

using nlohmann::json;

// What counts as odd. A splat is huge where its standard deviation is above this share of the
// diagonal of the inner bounds, and a needle where its longest axis is so many times the second.
constexpr double kHugeShare = 0.5;
constexpr double kNeedleRatio = 100;
constexpr double kOddShare = 0.01;  // needles and saturated splats below it are not worth a word
constexpr double kSaturatedLogit = 17;  // the sigmoid is 1 in float32, its gradient 0

json percentiles(std::vector<double>& values) {
    json result;
    if (values.empty()) return result;
    for (const int p : {1, 10, 50, 90, 99})
        result[fmt::format("p{}", p)] = nearest_rank(values, p / 100.0);
    return result;
}

// World positions of the axis at these shares of the splats.
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

// Counts of odd splats, and the percentiles of scale and opacity.
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
    const SplatModel model = load_splats(path, &file, units);
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
    add_splats(model, info);
    add_warnings(info);
    return info;
}

}  // namespace darb
