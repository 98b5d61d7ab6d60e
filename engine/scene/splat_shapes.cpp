#include "engine/scene/splat_shapes.h"

#include <fmt/format.h>

#include "engine/core/error.h"

namespace darb {

void check_splat_shapes(const SplatModel& model) {
    if (model.sh_degree < 0 || model.sh_degree > 3)
        throw Error("splat model", fmt::format("has harmonics of degree {}", model.sh_degree),
                    "Degrees are 0 to 3.");
    for (int a = 0; a < kAttributeCount; ++a)
        if (const std::size_t held = attribute_values(model, a).size(),
            wanted = model.size() * model.floats(a);
            held != wanted)
            throw Error("splat model",
                        fmt::format("{} holds {} values, {} splats need {}", attribute_name(a),
                                    held, model.size(), wanted),
                        "Each array holds the values of all splats, as splat_attributes.h says.");
}

}  // namespace darb
