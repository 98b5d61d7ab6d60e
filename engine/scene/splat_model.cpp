// SPDX-License-Identifier: MIT
#include "engine/scene/splat_model.h"

#include <fmt/format.h>

#include "engine/core/error.h"
#include "engine/kernels/shaped_kernel.h"

namespace darb {

std::string ply_column(int attribute, std::size_t column) {
    const SplatAttribute& row = kSplatAttributes[static_cast<std::size_t>(attribute)];
    if (attribute == kPosition) return std::string(1, row.file_name[column]);
    if (row.floats == 1 && !row.per_coefficient) return row.file_name;
    return std::string(row.file_name) + "_" + std::to_string(column);
}

void check_splat_shapes(const SplatModel& model) {
    if (model.sh_degree < 0 || model.sh_degree > 3)
        throw Error("splat model", fmt::format("has harmonics of degree {}", model.sh_degree),
                    "Degrees are 0 to 3.");
    for (int a = 0; a < kAttributeCount; ++a)
        if (const std::size_t held = attribute_values(model, a).size(),
            wanted = model.size() * model.floats(a);
            held != wanted)
            throw Error(
                "splat model",
                fmt::format("{} holds {} values, but {} splats need {}", attribute_name(a), held,
                            model.size(), wanted),
                "Each array holds the values of all splats: see engine/scene/splat_model.h.");
    if (kernel_takes(model.kernel, kShape) && model.shape.size() != model.size())
        throw Error("splat model",
                    fmt::format("{} splats of the kernel {} have no shape", model.size(),
                                kernel_name(model.kernel)),
                    "Call set_kernel, which gives them one.");
}

bool kernel_takes(int kernel, int attribute) {
    if (!kSplatAttributes[static_cast<std::size_t>(attribute)].optional) return true;
    return attribute == kShape && kernel_has_shape(kernel);
}

void set_kernel(SplatModel& model, int kernel) {
    model.kernel = kernel;
    if (!kernel_takes(kernel, kShape))
        model.shape.clear();
    else if (model.shape.size() != model.size())
        model.shape.assign(model.size(), 0.0f);
}

void settle_shapes(SplatModel& model, std::vector<std::string>& notes) {
    if (kernel_takes(model.kernel, kShape) && model.shape.empty() && model.size() > 0)
        notes.push_back(
            fmt::format("the kernel {} takes a shape of each splat, and the file has "
                        "none: all have that at which training starts",
                        kernel_name(model.kernel)));
    set_kernel(model, model.kernel);
}

}  // namespace darb
