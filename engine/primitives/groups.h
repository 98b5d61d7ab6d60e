// How many workgroups a pass over `count` items takes, in two dimensions where one is not enough;
// the shader side is shaders/lib/linear_id.glsl.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "shaders/shared/render_args.h"

namespace darb {

struct Groups {
    std::uint32_t x = 1, y = 1;
};

inline Groups groups_for(std::uint64_t count, std::uint32_t threads = SPLAT_GROUP) {
    const std::uint64_t n = count == 0 ? 1 : (count + threads - 1) / threads;
    const std::uint64_t y = (n + MAX_GROUPS - 1) / MAX_GROUPS;
    return {static_cast<std::uint32_t>((n + y - 1) / y), static_cast<std::uint32_t>(y)};
}

/// Splats of one dispatch, where not all rows of an attribute fit one binding.
struct SplatRange {
    std::uint32_t first = 0, count = 0;
};

/// [0, count) in ranges whose rows of so many floats each fit `binding_bytes`; one where all fit.
/// Ranges begin at multiples of 64 splats, so that a row's offset is one of 256 bytes.
inline std::vector<SplatRange> splat_ranges(std::uint32_t count, std::uint32_t floats,
                                            std::uint64_t binding_bytes) {
    const std::uint64_t row = std::uint64_t{floats} * sizeof(float);
    const std::uint64_t most =
        row == 0 ? count : std::max<std::uint64_t>(binding_bytes / row / 64 * 64, 64);
    std::vector<SplatRange> ranges;
    for (std::uint64_t first = 0; first < count; first += most)
        ranges.push_back(
            {static_cast<std::uint32_t>(first),
             static_cast<std::uint32_t>(std::min<std::uint64_t>(most, count - first))});
    return ranges;
}

}  // namespace darb
