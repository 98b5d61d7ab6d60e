// SPDX-License-Identifier: MIT
#include "tools/python/splat_arrays.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/kernels/shaped_kernel.h"
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

void split_harmonics(const Floats& sh, std::vector<float>& first, std::vector<float>& others) {
    const auto n = static_cast<std::size_t>(sh.shape[0]);
    const std::size_t rest = 3 * (std::size_t(sh.shape[1]) - 1);
    first.resize(3 * n);
    others.resize(rest * n);
    for (std::size_t i = 0; i < n; ++i) {
        const float* from = sh.data + i * (3 + rest);
        std::copy_n(from, 3, first.begin() + static_cast<std::ptrdiff_t>(3 * i));
        std::copy_n(from + 3, rest, others.begin() + static_cast<std::ptrdiff_t>(rest * i));
    }
}

namespace {

struct Range {
    float least, most;
    const char* hint;
};

Range range_of(int attribute) {
    if (attribute == kLogScale)
        return {0, kMost, "Scales are standard deviations, not logarithms."};
    if (attribute == kOpacityLogit) return {0, 1, "Opacities are from 0 to 1, not logits."};
    return {-kMost, kMost, kFinite};
}

}  // namespace

bool SplatArraysGiven::accepts(int attribute, std::span<const float> values) {
    const Range range = range_of(attribute);
    return range.least == -kMost || are_within(values, range.least, range.most);
}

void SplatArraysGiven::check_values() const {
    const auto check = [](int attribute, const Floats& values, const char* name) {
        const Range range = range_of(attribute);
        python::check_values(values, name, range.least, range.most, range.hint);
    };
    check(kPosition, means, "means");
    check(kRotation, quats, "quats");
    check(kLogScale, scales, "scales");
    check(kOpacityLogit, opacities, "opacities");
    check(kShDc, colours, direct_colour ? "colors" : "sh");
    check(kShape, shapes, "shapes");
}

GivenValues SplatArraysGiven::values() const {
    GivenValues all;
    all.attributes[kPosition] = means.values();
    all.attributes[kRotation] = quats.values();
    all.attributes[kLogScale] = scales.values();
    all.attributes[kOpacityLogit] = opacities.values();
    all.attributes[kShape] = shapes.values();
    (direct_colour ? all.attributes[kShDc] : all.harmonics) = colours.values();
    return all;
}

SplatModel SplatArraysGiven::model() const {
    check_values();
    SplatModel model = header;
    model.position = means.copy();
    model.rotation = quats.copy();
    model.log_scale = scales.copy();
    attribute_values(model, kOpacityLogit) = opacities.copy();
    attribute_values(model, kShape) = shapes.copy();
    if (direct_colour)
        model.sh_dc = colours.copy();
    else
        split_harmonics(colours, model.sh_dc, model.sh_rest);
    return model;
}

Floats take_shapes(const py::object& value, int kernel, py::ssize_t count) {
    if (kernel_has_shape(kernel)) {
        if (!value.is_none()) return take_floats(value, "shapes", {count});
        const std::vector<float> start(static_cast<std::size_t>(count));
        return take_floats(to_array(start, {count}), "shapes", {count});
    }
    if (value.is_none()) return {};
    throw Error("shapes", fmt::format("are given to the kernel {}", kernel_name(kernel)),
                "Leave them out: only kernels that learn a shape of each splat take them: beta, "
                "generalized_exponential, ges_published, blend:FIRST,SECOND.");
}

SplatArraysGiven take_splats(const py::dict& options) {
    SplatArraysGiven given;
    SplatModel& header = given.header;
    given.means = take_floats(options["means"], "means", {kAny, 3});
    const py::ssize_t n = given.means.shape[0];
    given.quats = take_floats(options["quats"], "quats", {n, 4});
    given.scales = take_floats(options["scales"], "scales", {n, 3});
    given.opacities = take_floats(options["opacities"], "opacities", {n});
    given.direct_colour = options["sh"].is_none();
    if (given.direct_colour == options["colors"].is_none())
        throw Error("colors and sh", given.direct_colour ? "are both left out" : "are both given",
                    "Give one: colors (N, 3), or sh (N, K, 3).");
    given.colours = given.direct_colour ? take_floats(options["colors"], "colors", {n, 3})
                                        : take_floats(options["sh"], "sh", {n, kAny, 3});
    if (!options["kernel"].is_none()) header.kernel = take_kernel(options["kernel"], "kernel");
    given.shapes = take_shapes(options["shapes"], header.kernel, n);
    if (!options["footprint"].is_none()) header.footprint = take_footprint(options["footprint"]);
    if (!options["antialiased"].is_none())
        header.antialias = take_flag(options["antialiased"], "antialiased");
    if (header.footprint == Footprint::exact && !has_exact_footprint(header.kernel))
        throw Error("footprint exact",
                    fmt::format("is not there for the kernel {}", kernel_name(header.kernel)),
                    "Use psi, or a kernel of one pulse.");
    if (!given.direct_colour) header.sh_degree = degree_of_coefficients(given.colours.shape[1]);
    return given;
}

}  // namespace darb::python
