// SPDX-License-Identifier: MIT
// How the rows of an attribute lie in a buffer of the device: row by row, as in SplatModel, but
// those of each coefficient in blocks of ROW_BLOCK splats, in each a column of as many vec4 after
// the other, so that neighbouring threads read neighbouring words (shaders/lib/rows.glsl).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/gpu/buffer.h"

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

struct AttributeRows {
    std::uint32_t floats = 0;   // floats per splat, in SplatModel's order
    std::uint32_t columns = 0;  // vec4 per splat where splats lie in blocks; 0: row by row

    /// Floats that a splat takes, padding included.
    std::uint32_t floats_held() const { return columns > 0 ? 4 * columns : floats; }
    /// Whole blocks of splats.
    std::uint64_t rows_held(std::uint64_t splats) const;
    std::uint64_t bytes(std::uint64_t splats) const;
};

/// For an attribute of so many floats a splat; of_each: values per float, 2 for moments (first,
/// second).
AttributeRows attribute_rows(int attribute, std::uint32_t floats, std::uint32_t of_each = 1);

/// The rows of a range of splats, such as splat_ranges() gives.
BufferRange range_of_rows(const Buffer& buffer, const AttributeRows& rows, const SplatRange& range);
/// The same where splats lie in blocks; else the whole buffer, as what a frame holds of a splat is
/// wider.
BufferRange bound_rows(const Buffer& buffer, const AttributeRows& rows, const SplatRange& range);

/// Writes the rows [first, first + count) of [N][floats], whose rows are `pitch` floats apart, to
/// where they lie in a buffer of N splats that begins at `to`; first: a multiple of ROW_BLOCK, as
/// count is but where N ends there. Padding becomes 0. Returns whether all values are finite. A
/// thread calls stream_fence() after the last of its calls.
bool put_rows(const AttributeRows& rows, const float* values, std::size_t pitch, std::size_t first,
              std::size_t count, std::byte* to);

/// [N][floats] as a buffer holds them, and back.
std::vector<float> held_rows(const AttributeRows& rows, std::span<const float> values);
std::vector<float> values_of_rows(const AttributeRows& rows, std::span<const float> held,
                                  std::size_t splats);

/// Blocking copies of [N][floats] in SplatModel's order; the queue is idle afterwards.
void upload_rows(Buffer& buffer, const AttributeRows& rows, std::span<const float> values);
std::vector<float> download_rows(const Buffer& buffer, const AttributeRows& rows,
                                 std::size_t splats);

}  // namespace darb
