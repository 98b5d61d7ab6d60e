#include "engine/gpu/tuning.h"

#include <algorithm>

#include "engine/gpu/device.h"

namespace darb {

Tuning usual_tuning(const DeviceInfo& info) {
    constexpr std::uint32_t blocks = 4;  // of a tile; a subgroup a block is the best on lavapipe
    const bool lavapipe = info.driver.starts_with("llvmpipe");
    return {lavapipe, lavapipe ? SortScatter::columns : SortScatter::ballot,
            blocks * std::clamp(info.subgroup_size, 4u, 64u),
            lavapipe ? BackwardBlend::subgroup : BackwardBlend::team, LossWay::strips};
}

}  // namespace darb
