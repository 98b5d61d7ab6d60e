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

std::uint64_t rest_sum_bytes(std::uint64_t splats, const SplatFloats& of) {
    const std::uint32_t floats = of.rest_sum ? attribute_floats(kShRest, of.sh_degree) : 0;
    return Buffer::charged_bytes(attribute_rows(kShRest, floats).bytes(splats));
}

std::uint64_t round_bytes(std::uint32_t before, std::uint32_t after, const SplatFloats& of) {
    std::vector<AttributeRows> replaced;  // in each buffer
    const auto strides = GpuSplats::strides(of.sh_degree, of.kernel);
    for (int a = 0; a < kAttributeCount; ++a)
        for (const std::uint32_t of_each : {1u, 2u})
            replaced.push_back(attribute_rows(a, strides[a], of_each));
    replaced.push_back(attribute_rows(kShRest, of.rest_sum ? strides[kShRest] : 0));
    const auto bytes = [](std::uint64_t splats, const AttributeRows& each) {
        return Buffer::charged_bytes(each.bytes(splats));
    };
    std::uint64_t held = 0;
    for (const AttributeRows& each : replaced) held += bytes(before, each);
    std::uint64_t most = held;
    for (const AttributeRows& each : replaced) {
        if (each.floats == 0) continue;
        held += bytes(after, each);
        most = std::max(most, held);
        held -= bytes(before, each);
    }
    return most + charged_bytes(RoundBuffers::list(before)) + Scan::device_bytes(before);
}

}  // namespace darb
