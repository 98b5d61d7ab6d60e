#include "engine/gpu/tuning.h"

#include <algorithm>

#include "engine/gpu/device.h"

namespace darb {

std::uint32_t lanes_by_pixels(const DeviceInfo& info, std::uint32_t chosen) {
    constexpr std::uint32_t most = 32, shared_bytes = 32 * 1024;
    if (info.shared_memory_bytes < shared_bytes || info.min_subgroup_size > most) return 0;
    return std::min(chosen, most);
}

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
