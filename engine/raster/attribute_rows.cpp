#include "engine/raster/attribute_rows.h"

#include <algorithm>
#include <cstring>

#include "engine/core/check.h"
#include "engine/core/on_threads.h"
#include "engine/scene/splat_attributes.h"

namespace darb {

namespace {

constexpr std::size_t kBlockRows = ROW_BLOCK, kColumnFloats = 4, kBlocksOfPiece = 512;
constexpr std::size_t kColumnBytes = kColumnFloats * sizeof(float);

// Bytes from the begin of the buffer.
std::size_t column_at(const AttributeRows& rows, std::size_t row, std::size_t column) {
    return ((row / kBlockRows * rows.columns + column) * kBlockRows + row % kBlockRows) *
           kColumnBytes;
}

// Of the floats of a splat in a column; 0 beyond the last.
std::size_t floats_in(const AttributeRows& rows, std::size_t column) {
    return std::min(kColumnFloats,
                    rows.floats - std::min<std::size_t>(column * kColumnFloats, rows.floats));
}

}  // namespace

std::uint64_t AttributeRows::rows_held(std::uint64_t splats) const {
    return columns > 0 ? (splats + kBlockRows - 1) / kBlockRows * kBlockRows : splats;
}

std::uint64_t AttributeRows::bytes(std::uint64_t splats) const {
    return rows_held(splats) * floats_held() * sizeof(float);
}

AttributeRows attribute_rows(int attribute, std::uint32_t floats, std::uint32_t of_each) {
    const bool blocks = kSplatAttributes[static_cast<std::size_t>(attribute)].per_coefficient;
    return {floats * of_each, blocks ? (floats + 3) / 4 * of_each : 0};
}

BufferRange range_of_rows(const Buffer& buffer, const AttributeRows& rows,
                          const SplatRange& range) {
    if (rows.floats == 0) return buffer;
    return {buffer, std::uint64_t{range.first} * rows.floats_held() * sizeof(float),
            rows.bytes(range.count)};
}

BufferRange bound_rows(const Buffer& buffer, const AttributeRows& rows, const SplatRange& range) {
    return rows.columns > 0 ? range_of_rows(buffer, rows, range) : buffer;
}

void put_rows(const AttributeRows& rows, const float* values, std::size_t pitch, std::size_t first,
              std::size_t count, std::byte* to) {
    const std::size_t row_bytes = rows.floats * sizeof(float);
    if (rows.floats == 0) return;
    if (rows.columns == 0) {
        for (std::size_t i = first; i < first + count; ++i)
            std::memcpy(to + i * row_bytes, values + i * pitch, row_bytes);
        return;
    }
    constexpr std::size_t kStep = kBlockRows * kColumnBytes;  // from a column to the next
    const std::size_t whole = rows.floats / kColumnFloats, last = floats_in(rows, whole);
    for (std::size_t i = first; i < first + rows.rows_held(count); ++i) {
        const bool there = i < first + count;
        std::byte* const at = to + column_at(rows, i, 0);
        const float* const row = there ? values + i * pitch : nullptr;
        if (there)
            for (std::size_t c = 0; c < whole; ++c)
                std::memcpy(at + c * kStep, row + c * kColumnFloats, kColumnBytes);
        for (std::size_t c = there ? whole : 0; c < rows.columns; ++c)
            std::memset(at + c * kStep, 0, kColumnBytes);
        if (there && last > 0)
            std::memcpy(at + whole * kStep, row + whole * kColumnFloats, last * sizeof(float));
    }
}

namespace {

void put_all(const AttributeRows& rows, std::span<const float> values, std::size_t splats,
             std::byte* to) {
    DARB_CHECK(splats * rows.floats == values.size(), "{} values in rows of {}", values.size(),
               rows.floats);
    in_pieces(splats, kBlocksOfPiece * kBlockRows, [&](std::size_t first, std::size_t count) {
        put_rows(rows, values.data(), rows.floats, first, count, to);
    });
}

}  // namespace

std::vector<float> held_rows(const AttributeRows& rows, std::span<const float> values) {
    const std::size_t splats = rows.floats > 0 ? values.size() / rows.floats : 0;
    std::vector<float> held(rows.bytes(splats) / sizeof(float));
    put_all(rows, values, splats, reinterpret_cast<std::byte*>(held.data()));
    return held;
}

std::vector<float> values_of_rows(const AttributeRows& rows, std::span<const float> held,
                                  std::size_t splats) {
    if (rows.columns == 0) return {held.begin(), held.end()};
    std::vector<float> values(splats * rows.floats);
    const std::byte* const from = std::as_bytes(held).data();
    in_pieces(splats, kBlocksOfPiece * kBlockRows, [&](std::size_t first, std::size_t count) {
        for (std::size_t i = first; i < first + count; ++i)
            for (std::size_t c = 0; c * kColumnFloats < rows.floats; ++c)
                std::memcpy(values.data() + i * rows.floats + c * kColumnFloats,
                            from + column_at(rows, i, c), floats_in(rows, c) * sizeof(float));
    });
    return values;
}

void upload_rows(Buffer& buffer, const AttributeRows& rows, std::span<const float> values) {
    if (rows.columns == 0 || values.empty()) return buffer.upload(std::as_bytes(values));
    const std::size_t splats = values.size() / rows.floats;
    buffer.upload_by(rows.bytes(splats), [&](std::byte* to) { put_all(rows, values, splats, to); });
}

std::vector<float> download_rows(const Buffer& buffer, const AttributeRows& rows,
                                 std::size_t splats) {
    if (splats * rows.floats == 0) return {};
    return values_of_rows(rows, buffer.download<float>(rows.bytes(splats) / sizeof(float)), splats);
}

}  // namespace darb
