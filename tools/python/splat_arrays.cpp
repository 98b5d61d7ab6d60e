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

void SplatArraysGiven::check_colours() const {
    check_values(colours, direct_colour ? "colors" : "sh", -kMost, kMost, kFinite);
}

SplatModel SplatArraysGiven::model() const {
    check_colours();
    SplatModel model = header;
    model.position = means.copy();
    model.rotation = quats.copy();
    model.log_scale = scales.copy();
    attribute_values(model, ATTRIBUTE_OPACITY_LOGIT) = opacities.copy();
    if (direct_colour)
        model.sh_dc = colours.copy();
    else
        split_harmonics(colours, model.sh_dc, model.sh_rest);
    return model;
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
    if (kernel_has_shape(header.kernel))
        throw Error(fmt::format("kernel {}", kernel_name(header.kernel)),
                    "takes a shape of each splat, which this call has no place for",
                    "Load or train a scene of it: darb.Scene, darb.Trainer.");
    if (!options["footprint"].is_none()) header.footprint = take_footprint(options["footprint"]);
    if (!options["antialiased"].is_none())
        header.antialias = take_flag(options["antialiased"], "antialiased");
    if (header.footprint == Footprint::exact && !has_exact_footprint(header.kernel))
        throw Error("footprint exact",
                    fmt::format("is not there for the kernel {}", kernel_name(header.kernel)),
                    "Use psi, or a kernel of one pulse.");
    check_values(given.means, "means", -kMost, kMost, kFinite);
    check_values(given.quats, "quats", -kMost, kMost, kFinite);
    check_values(given.scales, "scales", 0, kMost,
                 "Scales are standard deviations, not logarithms.");
    check_values(given.opacities, "opacities", 0, 1, "Opacities are from 0 to 1, not logits.");
    if (!given.direct_colour) header.sh_degree = degree_of_coefficients(given.colours.shape[1]);
    return given;
}

}  // namespace darb::python
