#include "trainer/density/round_buffers.h"

#include <algorithm>
#include <vector>

#include "engine/primitives/scan.h"
#include "engine/raster/gpu_splats.h"

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

std::uint64_t rest_sum_bytes(std::uint64_t splats, int sh_degree, bool rest_sum) {
    const std::uint64_t stride = rest_sum ? GpuSplats::strides(sh_degree)[kShRest] : 0;
    return Buffer::charged_bytes(splats * stride * sizeof(float));
}

std::uint64_t round_bytes(std::uint32_t before, std::uint32_t after, int sh_degree, bool rest_sum) {
    std::vector<std::uint64_t> floats;  // of a splat in each buffer that is replaced
    for (const std::uint64_t stride : GpuSplats::strides(sh_degree))
        floats.insert(floats.end(), {stride, 2 * stride});
    floats.push_back(rest_sum ? GpuSplats::strides(sh_degree)[kShRest] : 0);
    const auto bytes = [](std::uint64_t splats, std::uint64_t each) {
        return Buffer::charged_bytes(splats * each * sizeof(float));
    };
    std::uint64_t held = 0;
    for (const std::uint64_t each : floats) held += bytes(before, each);
    std::uint64_t most = held;
    for (const std::uint64_t each : floats) {
        if (each == 0) continue;
        held += bytes(after, each);
        most = std::max(most, held);
        held -= bytes(before, each);
    }
    return most + charged_bytes(RoundBuffers::list(before)) + Scan::device_bytes(before);
}

}  // namespace darb
