// Gradients on their way to another rank: rows of splats that a view showed.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "engine/core/error.h"
#include "engine/raster/attribute_rows.h"
#include "trainer/batch_step.h"

namespace darb {

namespace {

constexpr AttributeRows kPairs{2, 0};  // of views

// What travels of a splat, one buffer after the other: visit(buffer, its rows, floats in use).
template <class Gradients, class Visit>
void for_each_column(Gradients& gradients, int sh_degree, Visit visit) {
    visit(gradients.views(), kPairs, std::size_t{2});
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::size_t held = gradients.stride(a);
        const std::size_t floats =
            a == kShRest ? std::min<std::size_t>(attribute_floats(a, sh_degree), held) : held;
        if (floats > 0) visit(gradients.of(a), gradients.rows(a), floats);
    }
}

std::size_t mask_bytes(std::size_t splats) {
    return (splats + 7) / 8;
}

bool is_shown(std::span<const std::byte> mask, std::size_t splat) {
    return (mask[splat / 8] & std::byte(1 << splat % 8)) != std::byte{0};
}

}  // namespace

Bytes packed_gradients(const GradientBuffers& gradients, int sh_degree) {
    const std::size_t n = gradients.count();
    Bytes bytes(mask_bytes(n));
    if (n == 0) return bytes;
    const std::vector<float> views = download_rows(gradients.views(), kPairs, n);
    std::size_t shown = 0;
    for (std::size_t i = 0; i < n; ++i) {
        if (views[2 * i + 1] == 0) continue;
        bytes[i / 8] |= std::byte(1 << i % 8);
        ++shown;
    }
    for_each_column(gradients, sh_degree,
                    [&](const Buffer& buffer, const AttributeRows& rows, std::size_t floats) {
                        const std::vector<float> values = download_rows(buffer, rows, n);
                        std::size_t at = bytes.size();
                        bytes.resize(at + shown * floats * sizeof(float));
                        for (std::size_t i = 0; i < n; ++i) {
                            if (!is_shown(bytes, i)) continue;
                            std::memcpy(&bytes[at], &values[i * rows.floats],
                                        floats * sizeof(float));
                            at += floats * sizeof(float);
                        }
                    });
    return bytes;
}

void unpack_gradients(std::span<const std::byte> bytes, int sh_degree, GradientBuffers& to) {
    const std::size_t n = to.count();
    std::size_t shown = 0, floats_a_row = 0;
    if (bytes.size() >= mask_bytes(n))
        for (std::size_t i = 0; i < n; ++i) shown += is_shown(bytes, i) ? 1 : 0;
    for_each_column(to, sh_degree, [&](const Buffer&, const AttributeRows&, std::size_t floats) {
        floats_a_row += floats;
    });
    if (bytes.size() != mask_bytes(n) + shown * floats_a_row * sizeof(float))
        throw Error("gradients of another rank",
                    fmt::format("{} bytes for {} splats, {} of them shown", bytes.size(), n, shown),
                    "The ranks do not train the same splats: go on from the last checkpoint.");
    if (n == 0) return;
    std::size_t at = mask_bytes(n);
    for_each_column(
        to, sh_degree, [&](Buffer& buffer, const AttributeRows& rows, std::size_t floats) {
            std::vector<float> values(n * rows.floats, 0.0f);
            for (std::size_t i = 0; i < n; ++i) {
                if (!is_shown(bytes, i)) continue;
                std::memcpy(&values[i * rows.floats], &bytes[at], floats * sizeof(float));
                at += floats * sizeof(float);
            }
            upload_rows(buffer, rows, values);
        });
}

}  // namespace darb
