#include "engine/data/exif.h"

#include <cstdint>
#include <cstring>

namespace darb {

namespace {

using Bytes = std::span<const std::byte>;

std::uint32_t read_uint(Bytes bytes, std::size_t at, std::size_t size, bool little) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < size; ++i) {
        const std::size_t from = little ? at + size - 1 - i : at + i;
        value = (value << 8) | std::to_integer<std::uint32_t>(bytes[from]);
    }
    return value;
}

/// tiff: from the byte order mark on. IFD0 is a count and 12-byte entries: tag, type, count, value.
int tiff_orientation(Bytes tiff) {
    constexpr std::uint32_t kOrientationTag = 0x0112, kShort = 3, kEntryBytes = 12;
    if (tiff.size() < 8) return 1;
    const bool little = tiff[0] == std::byte{'I'};
    if (read_uint(tiff, 0, 2, true) != (little ? 0x4949u : 0x4d4du)) return 1;
    if (read_uint(tiff, 2, 2, little) != 42) return 1;
    const std::size_t directory = read_uint(tiff, 4, 4, little);
    if (directory > tiff.size() || tiff.size() - directory < 2) return 1;
    const std::size_t count = read_uint(tiff, directory, 2, little);
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t entry = directory + 2 + i * kEntryBytes;
        if (tiff.size() < entry + kEntryBytes) return 1;
        if (read_uint(tiff, entry, 2, little) != kOrientationTag) continue;
        if (read_uint(tiff, entry + 2, 2, little) != kShort) return 1;
        const std::uint32_t value = read_uint(tiff, entry + 8, 2, little);
        return value >= 1 && value <= 8 ? static_cast<int>(value) : 1;
    }
    return 1;
}

}  // namespace

int exif_orientation(Bytes file) {
    constexpr std::uint32_t kStartOfImage = 0xd8, kStartOfScan = 0xda, kApp1 = 0xe1;
    if (file.size() < 4 || read_uint(file, 0, 2, false) != (0xff00u | kStartOfImage)) return 1;
    for (std::size_t at = 2; at + 4 <= file.size();) {
        if (file[at] != std::byte{0xff}) return 1;
        const std::uint32_t marker = read_uint(file, at + 1, 1, false);
        if (marker == 0xff) {  // fill byte
            ++at;
            continue;
        }
        if (marker == kStartOfScan) return 1;
        const std::size_t length = read_uint(file, at + 2, 2, false);
        if (length < 2 || file.size() - at - 2 < length) return 1;
        const Bytes segment = file.subspan(at + 4, length - 2);
        if (marker == kApp1 && segment.size() > 6 &&
            std::memcmp(segment.data(), "Exif\0\0", 6) == 0)
            return tiff_orientation(segment.subspan(6));
        at += 2 + length;
    }
    return 1;
}

}  // namespace darb
