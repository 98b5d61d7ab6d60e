#include "trainer/densify/round_buffers.h"

#include <algorithm>

#include "engine/render/gpu_splats.h"
#include "engine/render/scan.h"

namespace darb {

BufferList<RoundBuffers> RoundBuffers::list(std::uint64_t splats) {
    const std::uint64_t bytes = splats * 4;
    using R = RoundBuffers;
    return {{&R::keep, "densify keep", bytes},          {&R::grow, "densify grow", bytes},
            {&R::action, "densify action", bytes},      {&R::keep_offset, "keep offset", bytes},
            {&R::grow_offset, "grow offset", bytes},    {&R::count, "densify count", 4},
            {&R::keep_total, "keep total", 4},          {&R::grow_total, "grow total", 4},
            {&R::sources, "densify sources", bytes * 4}};  // at most twice as many, two words each
}

std::uint64_t round_bytes(std::uint32_t before, std::uint32_t after, int sh_degree) {
    const auto strides = GpuSplats::strides(sh_degree);
    const auto bytes = [](std::uint64_t splats, std::uint64_t floats) {
        return Buffer::charged_bytes(splats * floats * sizeof(float));
    };
    std::uint64_t held = 0;
    for (const std::uint32_t stride : strides)
        held += bytes(before, stride) + bytes(before, 2 * stride);
    std::uint64_t most = held;
    for (const std::uint32_t stride : strides) {
        if (stride == 0) continue;
        for (const std::uint32_t floats : {stride, 2 * stride}) {
            held += bytes(after, floats);
            most = std::max(most, held);
            held -= bytes(before, floats);
        }
    }
    return most + charged_bytes(RoundBuffers::list(before)) + Scan::device_bytes(before);
}

}  // namespace darb
