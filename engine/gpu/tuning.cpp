#include "engine/gpu/tuning.h"

#include <algorithm>

#include "engine/gpu/device.h"

namespace darb {

Tuning usual_tuning(const DeviceInfo& info) {
    constexpr std::uint32_t blocks = 4;  // of a tile; a subgroup a block is the best on lavapipe
    const bool lavapipe = info.driver.starts_with("llvmpipe");
    Tuning tuning;
    tuning.scan_by_thread = lavapipe;
    tuning.scatter = lavapipe ? SortScatter::columns : SortScatter::ballot;
    tuning.blend_threads = blocks * std::clamp(info.subgroup_size, 4u, 64u);
    tuning.backward = lavapipe ? BackwardBlend::subgroup : BackwardBlend::team;
    return tuning;
}

}  // namespace darb
