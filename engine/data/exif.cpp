#include "engine/data/exif.h"

#include <cstdint>
#include <cstring>
#include <optional>

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

struct Entry {
    std::uint32_t type = 0, count = 0;
    std::size_t value = 0;  // where it stands, or where the place of a longer one stands
};

/// tiff: from the byte order mark on. A directory is a count and 12-byte entries: tag, type, count,
/// value. Nothing where it has no such tag.
std::optional<Entry> find_entry(Bytes tiff, std::size_t directory, std::uint32_t tag, bool little) {
    constexpr std::uint32_t kEntryBytes = 12;
    if (directory > tiff.size() || tiff.size() - directory < 2) return {};
    const std::size_t count = read_uint(tiff, directory, 2, little);
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t entry = directory + 2 + i * kEntryBytes;
        if (tiff.size() < entry + kEntryBytes) return {};
        if (read_uint(tiff, entry, 2, little) == tag)
            return Entry{read_uint(tiff, entry + 2, 2, little),
                         read_uint(tiff, entry + 4, 4, little), entry + 8};
    }
    return {};
}

/// Whether it is one, and its byte order.
bool is_tiff(Bytes tiff, bool& little) {
    if (tiff.size() < 8) return false;
    little = tiff[0] == std::byte{'I'};
    return read_uint(tiff, 0, 2, true) == (little ? 0x4949u : 0x4d4du) &&
           read_uint(tiff, 2, 2, little) == 42;
}

int tiff_orientation(Bytes tiff) {
    constexpr std::uint32_t kOrientationTag = 0x0112, kShort = 3;
    bool little = false;
    if (!is_tiff(tiff, little)) return 1;
    const auto entry = find_entry(tiff, read_uint(tiff, 4, 4, little), kOrientationTag, little);
    if (!entry || entry->type != kShort) return 1;
    const std::uint32_t value = read_uint(tiff, entry->value, 2, little);
    return value >= 1 && value <= 8 ? static_cast<int>(value) : 1;
}

int tiff_focal_35mm(Bytes tiff) {
    constexpr std::uint32_t kExifTag = 0x8769, kFocalLength35mm = 0xa405, kShort = 3;
    bool little = false;
    if (!is_tiff(tiff, little)) return 0;
    const auto exif = find_entry(tiff, read_uint(tiff, 4, 4, little), kExifTag, little);
    if (!exif) return 0;
    const auto focal =
        find_entry(tiff, read_uint(tiff, exif->value, 4, little), kFocalLength35mm, little);
    if (!focal || focal->type != kShort) return 0;
    return static_cast<int>(read_uint(tiff, focal->value, 2, little));
}

std::string tiff_time(Bytes tiff) {
    constexpr std::uint32_t kExifTag = 0x8769, kTimeTag = 0x9003, kAscii = 2;
    constexpr std::size_t kLength = 19;
    bool little = false;
    if (!is_tiff(tiff, little)) return {};
    const auto exif = find_entry(tiff, read_uint(tiff, 4, 4, little), kExifTag, little);
    if (!exif) return {};
    const auto time = find_entry(tiff, read_uint(tiff, exif->value, 4, little), kTimeTag, little);
    if (!time || time->type != kAscii || time->count < kLength) return {};
    const std::size_t at = read_uint(tiff, time->value, 4, little);
    if (at > tiff.size() || tiff.size() - at < kLength) return {};
    std::string text;
    for (std::size_t i = 0; i < kLength; ++i) {
        const char c = static_cast<char>(tiff[at + i]);
        const bool mark = i == 4 || i == 7 || i == 10 || i == 13 || i == 16;
        if (mark ? c != (i == 10 ? ' ' : ':') : c < '0' || c > '9') return {};
        text += c;
    }
    return text;
}

/// What follows "Exif" in the file; nothing where there is none.
Bytes exif_of(Bytes file) {
    constexpr std::uint32_t kStartOfImage = 0xd8, kStartOfScan = 0xda, kApp1 = 0xe1;
    if (file.size() < 4 || read_uint(file, 0, 2, false) != (0xff00u | kStartOfImage)) return {};
    for (std::size_t at = 2; at + 4 <= file.size();) {
        if (file[at] != std::byte{0xff}) return {};
        const std::uint32_t marker = read_uint(file, at + 1, 1, false);
        if (marker == 0xff) {  // fill byte
            ++at;
            continue;
        }
        if (marker == kStartOfScan) return {};
        const std::size_t length = read_uint(file, at + 2, 2, false);
        if (length < 2 || file.size() - at - 2 < length) return {};
        const Bytes segment = file.subspan(at + 4, length - 2);
        if (marker == kApp1 && segment.size() > 6 &&
            std::memcmp(segment.data(), "Exif\0\0", 6) == 0)
            return segment.subspan(6);
        at += 2 + length;
    }
    return {};
}

}  // namespace

int exif_orientation(Bytes file) {
    return tiff_orientation(exif_of(file));
}

int exif_focal_35mm(Bytes file) {
    return tiff_focal_35mm(exif_of(file));
}

std::string exif_time(Bytes file) {
    return tiff_time(exif_of(file));
}

}  // namespace darb
