// SPDX-License-Identifier: MIT
#include "engine/data/las_points.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string_view>

#include "engine/core/error.h"

namespace darb {

namespace {

// Bytes of the header at which its numbers stand.
constexpr std::size_t kMajorAt = 24, kHeaderSizeAt = 94, kPointsAt = 96, kFormatAt = 104,
                      kRecordSizeAt = 105, kCountAt = 107, kScaleAt = 131, kOffsetAt = 155,
                      kLongCountAt = 247;
constexpr std::size_t kShortHeader = 227, kLongHeader = 375;  // bytes, of versions to 1.3 and 1.4
constexpr int kCompressed = 0x80;                             // bits of the point format in LAZ

struct LasFormat {
    std::size_t bytes;   // of a point, at least
    std::size_t colour;  // byte at which it stands; 0: there is none
    std::size_t flags;   // byte with the bit `withheld`
    int withheld;        // that bit
};
constexpr LasFormat kLasFormats[] = {{20, 0, 15, 0x80},  {28, 0, 15, 0x80},  {26, 20, 15, 0x80},
                                     {34, 28, 15, 0x80}, {57, 0, 15, 0x80},  {63, 28, 15, 0x80},
                                     {30, 0, 15, 0x04},  {36, 30, 15, 0x04}, {38, 30, 15, 0x04},
                                     {59, 0, 15, 0x04},  {67, 30, 15, 0x04}};

template <class T>
T las_value(std::span<const std::byte> bytes, std::size_t at) {
    T value;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
}

struct LasHeader {
    std::uint64_t points = 0, begin = 0;
    std::size_t record = 0;
    LasFormat format{};
    std::array<double, 3> scale{}, offset{};
};

[[noreturn]] void refuse_las(const std::string& where, const std::string& reason) {
    throw Error(where, reason, "The file is cut off or damaged: export or copy it again.");
}

LasHeader read_las_header(std::span<const std::byte> file, const std::string& where) {
    if (file.size() < kShortHeader)
        refuse_las(where, fmt::format("holds {} bytes; the header of LAS has {}", file.size(),
                                      kShortHeader));
    const auto major = static_cast<int>(file[kMajorAt]),
               minor = static_cast<int>(file[kMajorAt + 1]);
    if (major != 1 || minor > 4)
        throw Error(where, fmt::format("is LAS version {}.{}; 1.0 to 1.4 are known", major, minor),
                    "Export it as one of these, or as PLY.");
    const auto format = static_cast<int>(file[kFormatAt]);
    if (format & kCompressed)
        throw Error(where, "is LAZ, the compressed form of LAS, which is not read",
                    "Expand it with `laszip -i FILE.laz -o FILE.las`, or write a PLY with PDAL or "
                    "CloudCompare.");
    if (format >= static_cast<int>(std::size(kLasFormats)))
        throw Error(where, fmt::format("has points of format {}; 0 to 10 are known", format),
                    "Export it with another point format, or as PLY.");
    LasHeader header;
    header.format = kLasFormats[format];
    header.begin = las_value<std::uint32_t>(file, kPointsAt);
    header.record = las_value<std::uint16_t>(file, kRecordSizeAt);
    header.points = las_value<std::uint32_t>(file, kCountAt);
    const std::size_t size = las_value<std::uint16_t>(file, kHeaderSizeAt);
    if (minor == 4 && size >= kLongHeader && file.size() >= kLongHeader)
        header.points = las_value<std::uint64_t>(file, kLongCountAt);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        header.scale[axis] = las_value<double>(file, kScaleAt + 8 * axis);
        header.offset[axis] = las_value<double>(file, kOffsetAt + 8 * axis);
        if (!std::isfinite(header.scale[axis]) || header.scale[axis] == 0 ||
            !std::isfinite(header.offset[axis]))
            refuse_las(where, fmt::format("has the scale {} and the offset {} on axis {}",
                                          header.scale[axis], header.offset[axis], axis));
    }
    if (header.record < header.format.bytes)
        refuse_las(where, fmt::format("has points of {} bytes; those of format {} have {}",
                                      header.record, format, header.format.bytes));
    const std::uint64_t room = file.size() < header.begin ? 0 : file.size() - header.begin;
    if (header.begin < size || header.begin > file.size() || header.points > room / header.record)
        refuse_las(where, fmt::format("declares {} points of {} bytes from byte {} on, but holds "
                                      "{} bytes",
                                      header.points, header.record, header.begin, file.size()));
    return header;
}

}  // namespace

bool looks_like_las(std::span<const std::byte> file) {
    constexpr std::string_view kSignature = "LASF";
    return file.size() >= kSignature.size() &&
           std::equal(kSignature.begin(), kSignature.end(), file.begin(),
                      [](char c, std::byte b) { return std::byte(c) == b; });
}

PointCloud parse_las(std::span<const std::byte> file, const std::string& where,
                     std::size_t& dropped, std::vector<std::string>* notes) {
    if (!looks_like_las(file))
        throw Error(where, "is no LAS file: it does not begin with LASF", "Check the path.");
    const LasHeader header = read_las_header(file, where);
    PointCloud points;
    points.position.reserve(3 * header.points);
    std::vector<std::uint16_t> colours;
    dropped = 0;
    for (std::uint64_t i = 0; i < header.points; ++i) {
        const auto record = file.subspan(header.begin + i * header.record, header.record);
        std::array<double, 3> at{};
        bool finite = true;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            at[axis] = header.scale[axis] * las_value<std::int32_t>(record, 4 * axis) +
                       header.offset[axis];
            finite = finite && std::isfinite(at[axis]);
        }
        const auto flags = static_cast<int>(record[header.format.flags]);
        if (!finite || (flags & header.format.withheld) != 0) {
            ++dropped;
            continue;
        }
        points.position.insert(points.position.end(), at.begin(), at.end());
        for (std::size_t k = 0; k < 3 && header.format.colour > 0; ++k)
            colours.push_back(las_value<std::uint16_t>(record, header.format.colour + 2 * k));
    }
    points.colour.assign(points.position.size(), 128);
    const std::uint16_t brightest =
        colours.empty() ? std::uint16_t{0} : *std::max_element(colours.begin(), colours.end());
    const bool eight = brightest <= 255;  // many programs write these
    for (std::size_t i = 0; i < colours.size() && brightest > 0; ++i)
        points.colour[i] = static_cast<std::uint8_t>(eight ? colours[i] : colours[i] / 257);
    if (notes && brightest == 0 && !points.position.empty())
        notes->push_back(fmt::format("{} has no colours: its points are grey.", where));
    if (notes && brightest > 0 && eight)
        notes->push_back(fmt::format(
            "{} has no colour above 255: they are read as 8 bits, not as the 16 of LAS.", where));
    return points;
}

}  // namespace darb
