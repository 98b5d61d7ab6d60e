#include "tools/python/splat_arrays.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "tools/python/kernel.h"
#include "tools/python/rasterize.h"

namespace darb::python {

namespace {

constexpr float kMost = std::numeric_limits<float>::max();
constexpr const char* kFinite = "Check what it was computed from.";

}  // namespace

int degree_of_coefficients(py::ssize_t coefficients) {
    for (int degree = 0; degree <= 3; ++degree)
        if (coefficients == (degree + 1) * (degree + 1)) return degree;
    throw Error("sh", fmt::format("has {} coefficients a splat", coefficients),
                "1, 4, 9 or 16 of them make degrees 0 to 3: the shape is (N, K, 3).");
}

void split_harmonics(const Floats& sh, SplatModel& model) {
    const auto n = static_cast<std::size_t>(sh.shape[0]);
    const std::size_t rest = 3 * (std::size_t(sh.shape[1]) - 1);
    model.sh_dc.reserve(3 * n);
    model.sh_rest.reserve(rest * n);
    for (const float* from = sh.data; from != sh.data + sh.size(); from += 3 + rest) {
        model.sh_dc.insert(model.sh_dc.end(), from, from + 3);
        model.sh_rest.insert(model.sh_rest.end(), from + 3, from + 3 + rest);
    }
}

SplatArraysGiven take_splats(const py::dict& options) {
    SplatArraysGiven given;
    SplatModel& model = given.model;
    const Floats means = take_floats(options["means"], "means", {kAny, 3});
    const py::ssize_t n = means.shape[0];
    const Floats quats = take_floats(options["quats"], "quats", {n, 4});
    const Floats scales = take_floats(options["scales"], "scales", {n, 3});
    const Floats opacities = take_floats(options["opacities"], "opacities", {n});
    given.direct_colour = options["sh"].is_none();
    if (given.direct_colour == options["colors"].is_none())
        throw Error("colors and sh", given.direct_colour ? "are both left out" : "are both given",
                    "Give one: colors (N, 3), or sh (N, K, 3).");
    const Floats colours = given.direct_colour ? take_floats(options["colors"], "colors", {n, 3})
                                               : take_floats(options["sh"], "sh", {n, kAny, 3});
    if (!options["kernel"].is_none()) model.kernel = take_kernel(options["kernel"], "kernel");
    if (!options["footprint"].is_none()) model.footprint = take_footprint(options["footprint"]);
    if (!options["antialiased"].is_none())
        model.antialias = take_flag(options["antialiased"], "antialiased");
    if (model.footprint == Footprint::exact && !has_exact_footprint(model.kernel))
        throw Error("footprint exact",
                    fmt::format("is not there for the kernel {}", kernel_name(model.kernel)),
                    "Use psi, or a kernel of one pulse.");
    check_values(means, "means", -kMost, kMost, kFinite);
    check_values(quats, "quats", -kMost, kMost, kFinite);
    check_values(scales, "scales", 0, kMost, "Scales are standard deviations, not logarithms.");
    check_values(opacities, "opacities", 0, 1, "Opacities are from 0 to 1, not logits.");
    check_values(colours, given.direct_colour ? "colors" : "sh", -kMost, kMost, kFinite);
    model.position = means.copy();
    model.rotation = quats.copy();
    model.log_scale = scales.copy();
    attribute_values(model, ATTRIBUTE_OPACITY_LOGIT) = opacities.copy();
    if (given.direct_colour) model.sh_dc = colours.copy();
    if (given.direct_colour) return given;
    model.sh_degree = degree_of_coefficients(colours.shape[1]);
    split_harmonics(colours, model);
    return given;
}

}  // namespace darb::python
