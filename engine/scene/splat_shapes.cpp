#include "engine/scene/splat_shapes.h"

#include "engine/core/check.h"

namespace darb {

void check_splat_shapes(const SplatModel& model) {
    const std::size_t n = model.size();
    DARB_CHECK(model.sh_degree >= 0 && model.sh_degree <= 3, "degree {}", model.sh_degree);
    DARB_CHECK(model.position.size() == n * 3 && model.log_scale.size() == n * 3 &&
                   model.rotation.size() == n * 4 && model.sh_dc.size() == n * 3 &&
                   model.sh_rest.size() == n * static_cast<std::size_t>(model.rest_count()),
               "N = {}, rest {}", n, model.sh_rest.size());
}

}  // namespace darb
