// SPDX-License-Identifier: MIT
#include "trainer/growth/morton_order.h"

#include "engine/primitives/groups.h"
#include "engine/primitives/radix_sort.h"
#include "shaders/shared/order_args.h"

namespace darb {

MortonOrder::MortonOrder(Device& device) : device_(&device), commands_(device) {
    const SpecConstants threads{{"THREADS", SPLAT_GROUP}};
    key_ = Pipeline(device, "morton_key", threads);
    sources_ = Pipeline(device, "morton_sources", threads);
}

void MortonOrder::run(GpuSplats& splats, DensityControl& density, const MortonGrid& grid) {
    const std::uint32_t n = splats.count();
    if (n < 2) return;
    const std::uint64_t bytes = std::uint64_t{n} * 4;
    Buffer key(*device_, "morton key", bytes), order(*device_, "morton order", bytes),
        sources(*device_, "morton sources", bytes * 2), count(*device_, "morton count", 4);
    RadixSort sort(*device_, n);
    constexpr float cells = 1 << MORTON_AXIS_BITS;
    const gpu::MortonArgs args{n, grid.centre - grid.half_side, cells / (2 * grid.half_side)};
    const Groups g = groups_for(n);
    commands_.begin();
    commands_.pass("order");
    commands_.fill(count, n);
    commands_.dispatch(key_, args, {splats.parameters(kPosition), key}, g.x, g.y);
    keep_frozen(commands_, splats.frozen(), {{&key, 0}});  // stable: they stay the first
    sort.record(commands_, key, order, count, 0, 3 * MORTON_AXIS_BITS, true);
    commands_.dispatch(sources_, gpu::SplatArgs{n}, {order, sources}, g.x, g.y);
    commands_.submit_and_wait();
    density.move(splats, sources, n);
}

}  // namespace darb
