// Ranges of splats whose rows fit one binding of a device: what a pass works off one dispatch at a
// time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace darb {

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
