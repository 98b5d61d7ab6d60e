// SPDX-License-Identifier: MIT
#include "engine/raster/attribute_rows.h"

#include <algorithm>
#include <cstring>

#include "engine/core/error.h"
#include "engine/core/on_threads.h"
#include "engine/core/streaming.h"
#include "engine/scene/splat_model.h"

namespace darb {

namespace {

constexpr std::size_t kBlockRows = ROW_BLOCK, kColumnFloats = 4, kBlocksOfPiece = 512;
constexpr std::size_t kColumnBytes = kColumnFloats * sizeof(float);

// In bytes from the beginning of the buffer.
std::size_t column_at(const AttributeRows& rows, std::size_t row, std::size_t column) {
    return ((row / kBlockRows * rows.columns + column) * kBlockRows + row % kBlockRows) *
           kColumnBytes;
}

// How many of a splat's floats lie in a column; 0 beyond the last.
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

namespace {

// Writes what lies row by row; `to` is where the first row goes.
void put_plain(const AttributeRows& rows, const float* values, std::size_t pitch, std::size_t count,
               std::byte* to, FloatStream& stream) {
    if (pitch == rows.floats && can_stream(to))
        return stream.floats(to, values, count * rows.floats);
    constexpr std::size_t kColour = 3;  // a known length, so that the copy of so few is inlined
    for (std::size_t i = 0; i < count; ++i)
        if (rows.floats == kColour)
            stream.plain(to + i * kColour * sizeof(float), values + i * pitch, kColour);
        else
            stream.plain(to + i * rows.floats * sizeof(float), values + i * pitch, rows.floats);
}

// A block of which all rows are there; `to` and values are its begin.
void stream_block(const AttributeRows& rows, const float* values, std::size_t pitch, std::byte* to,
                  FloatStream& stream) {
    const auto each = [&](std::size_t column, const auto& put) {
        for (std::size_t k = 0; k < kBlockRows; ++k)
            put(to + (column * kBlockRows + k) * kColumnBytes,
                values + k * pitch + column * kColumnFloats);
    };
    for (std::size_t c = 0; c < rows.columns; ++c) {
        const std::size_t floats = floats_in(rows, c);
        if (floats == kColumnFloats) {
            each(c, [&](std::byte* at, const float* from) { stream.four(at, from); });
        } else if (floats == 1) {
            each(c, [&](std::byte* at, const float* from) { stream.one(at, from); });
        } else {
            each(c, [&](std::byte* at, const float* from) {
                float four[kColumnFloats] = {};
                for (std::size_t j = 0; j < floats; ++j) four[j] = from[j];
                stream.four(at, four);
            });
        }
    }
}

// Any rows of a block.
void put_block(const AttributeRows& rows, const float* values, std::size_t pitch, std::size_t count,
               std::byte* to, FloatStream& stream) {
    std::memset(to, 0, kBlockRows * rows.columns * kColumnBytes);
    for (std::size_t k = 0; k < count; ++k)
        for (std::size_t c = 0; c < rows.columns; ++c)
            if (const std::size_t floats = floats_in(rows, c); floats > 0)
                stream.plain(to + (c * kBlockRows + k) * kColumnBytes,
                             values + k * pitch + c * kColumnFloats, floats);
}

}  // namespace

bool put_rows(const AttributeRows& rows, const float* values, std::size_t pitch, std::size_t first,
              std::size_t count, std::byte* to) {
    if (rows.floats == 0 || count == 0) return true;
    FloatStream stream;
    to += first * rows.floats_held() * sizeof(float);
    values += first * pitch;
    if (rows.columns == 0) {
        put_plain(rows, values, pitch, count, to, stream);
    } else {
        const bool streams = can_stream(to);
        for (std::size_t i = 0; i < count; i += kBlockRows) {
            std::byte* const at = to + i * rows.floats_held() * sizeof(float);
            const float* const from = values + i * pitch;
            if (streams && count - i >= kBlockRows)
                stream_block(rows, from, pitch, at, stream);
            else
                put_block(rows, from, pitch, std::min(kBlockRows, count - i), at, stream);
        }
    }
    return stream.finite();
}

namespace {

void put_all(const AttributeRows& rows, std::span<const float> values, std::size_t splats,
             std::byte* to) {
    DARB_CHECK(splats * rows.floats == values.size(), "{} values in rows of {}", values.size(),
               rows.floats);
    in_pieces(splats, kBlocksOfPiece * kBlockRows, [&](std::size_t first, std::size_t count) {
        put_rows(rows, values.data(), rows.floats, first, count, to);
        stream_fence();
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
