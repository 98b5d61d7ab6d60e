// SPDX-License-Identifier: MIT
// Any bytes as a photo: an image or an Error, never a crash, and pixels that nothing but the bytes
// decides. The checksums of a PNG's chunks are made right first, so that what stands behind them is
// reached.
#include <malloc.h>
#include <zlib.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <vector>

#include "engine/core/error.h"
#include "engine/data/image_io.h"

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define DARB_FUZZ_WITH_ASAN
#endif
#endif

namespace {

constexpr std::int64_t kMostPixels = 1 << 16;  // larger ones are no more likely to break, and slow

std::size_t read_size(const std::uint8_t* at) {
    return std::size_t{at[0]} << 24 | std::size_t{at[1]} << 16 | std::size_t{at[2]} << 8 | at[3];
}

void mend_checksums(std::vector<std::uint8_t>& png) {
    constexpr std::size_t kSignature = 8, kAround = 12;
    if (png.size() < kSignature || std::memcmp(png.data(), "\x89PNG", 4) != 0) return;
    for (std::size_t at = kSignature; png.size() - at >= kAround;) {
        const std::size_t length = read_size(&png[at]);
        if (length > png.size() - at - kAround) return;
        const auto crc =
            static_cast<std::uint32_t>(crc32(0, &png[at + 4], static_cast<uInt>(length + 4)));
        for (std::size_t i = 0; i < 4; ++i)
            png[at + 8 + length + i] = static_cast<std::uint8_t>(crc >> (24 - 8 * i));
        at += length + kAround;
    }
}

/// What the allocator leaves in fresh memory is `fill`.
std::optional<darb::ImageU8> decode(std::span<const std::byte> file, int fill) {
    mallopt(M_PERTURB, fill);
    try {
        const darb::ImageInfo info = darb::parse_image_info(file, "fuzz");
        if (std::int64_t{info.width} * info.height > kMostPixels) return {};
        darb::ImageU8 image = darb::decode_image(file, "fuzz");
        const bool turned = info.orientation >= 5;
        DARB_CHECK(image.width == (turned ? info.height : info.width), "{}", image.width);
        DARB_CHECK(image.channels == (info.channels == 2 ? 4 : info.channels), "{}",
                   image.channels);
        return image;
    } catch (const darb::Error&) {
        return {};
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    std::vector<std::uint8_t> bytes(data, data + size);
    mend_checksums(bytes);
    const auto file = std::as_bytes(std::span(bytes));
    const std::optional<darb::ImageU8> image = decode(file, 0x55);
#ifndef DARB_FUZZ_WITH_ASAN  // whose allocator takes no fill
    const std::optional<darb::ImageU8> again = decode(file, 0xaa);
    DARB_CHECK(image.has_value() == again.has_value());
    if (image) DARB_CHECK(image->data == again->data);
#endif
    return 0;
}
