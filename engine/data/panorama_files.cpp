// SPDX-License-Identifier: MIT
#include "engine/data/panorama_files.h"

#include <fmt/format.h>
#include <zlib.h>

#include <array>
#include <cstdint>
#include <fstream>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/data/image_io.h"

namespace darb {

namespace {

using PanoramaBytes = std::vector<std::byte>;

void append(PanoramaBytes& to, std::string_view text) {
    for (const char c : text) to.push_back(static_cast<std::byte>(c));
}

void append_u32(PanoramaBytes& to, std::uint32_t value) {
    for (int shift = 24; shift >= 0; shift -= 8)
        to.push_back(static_cast<std::byte>(value >> shift & 0xFF));
}

std::uint32_t u32_at(std::span<const std::byte> bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i)
        value = value << 8 | std::to_integer<std::uint32_t>(bytes[at + i]);
    return value;
}

void put_u32(PanoramaBytes& bytes, std::size_t at, std::uint32_t value) {
    for (std::size_t i = 0; i < 4; ++i)
        bytes[at + i] = static_cast<std::byte>(value >> (24 - 8 * i) & 0xFF);
}

std::string photo_sphere_xmp(int width, int height) {
    return fmt::format(
        "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\"><rdf:RDF "
        "xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\"><rdf:Description "
        "rdf:about=\"\" xmlns:GPano=\"http://ns.google.com/photos/1.0/panorama/\" "
        "GPano:ProjectionType=\"equirectangular\" GPano:UsePanoramaViewer=\"True\" "
        "GPano:FullPanoWidthPixels=\"{0}\" GPano:FullPanoHeightPixels=\"{1}\" "
        "GPano:CroppedAreaImageWidthPixels=\"{0}\" GPano:CroppedAreaImageHeightPixels=\"{1}\" "
        "GPano:CroppedAreaLeftPixels=\"0\" GPano:CroppedAreaTopPixels=\"0\"/></rdf:RDF>"
        "</x:xmpmeta>",
        width, height);
}

constexpr std::string_view kSphericalVideo =
    "<?xml version=\"1.0\"?><rdf:SphericalVideo "
    "xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\" "
    "xmlns:GSpherical=\"http://ns.google.com/videos/1.0/spherical/\">"
    "<GSpherical:Spherical>true</GSpherical:Spherical>"
    "<GSpherical:Stitched>true</GSpherical:Stitched>"
    "<GSpherical:StitchingSoftware>darb</GSpherical:StitchingSoftware>"
    "<GSpherical:ProjectionType>equirectangular</GSpherical:ProjectionType>"
    "</rdf:SphericalVideo>";
// ffcc8263-f855-4a93-8814-587a02521fdd, the type of that box.
constexpr std::array<std::uint8_t, 16> kSphericalId{0xFF, 0xCC, 0x82, 0x63, 0xF8, 0x55, 0x4A, 0x93,
                                                    0x88, 0x14, 0x58, 0x7A, 0x02, 0x52, 0x1F, 0xDD};

/// A box of an MP4: a length of 4 bytes that counts itself, a type of 4 letters, what it holds.
struct Box {
    std::size_t begin = 0, end = 0;
};

/// The first box of a type in a range; nothing where there is none or a length leaves the range.
std::optional<Box> find_box(std::span<const std::byte> file, Box in, std::string_view type) {
    while (in.begin + 8 <= in.end) {
        std::uint64_t size = u32_at(file, in.begin);
        if (size == 1 && in.begin + 16 <= in.end)
            size = std::uint64_t{u32_at(file, in.begin + 8)} << 32 | u32_at(file, in.begin + 12);
        else if (size == 0)
            size = in.end - in.begin;
        if (size < 8 || size > in.end - in.begin) return std::nullopt;
        bool same = true;
        for (std::size_t i = 0; i < 4; ++i)
            same &= static_cast<char>(file[in.begin + 4 + i]) == type[i];
        if (same) return Box{in.begin, in.begin + static_cast<std::size_t>(size)};
        in.begin += static_cast<std::size_t>(size);
    }
    return std::nullopt;
}

Box inside(const Box& box) {
    return {box.begin + 8, box.end};
}

/// Where the handler type of a track's media stands, "vide" or "soun"; behind 8 bytes of its box's
/// version and a reserved word.
bool is_video(std::span<const std::byte> file, const Box& track) {
    const auto media = find_box(file, inside(track), "mdia");
    const auto handler = media ? find_box(file, inside(*media), "hdlr") : std::nullopt;
    if (!handler || handler->end - handler->begin < 20) return false;
    std::string type;
    for (std::size_t i = 0; i < 4; ++i) type += static_cast<char>(file[handler->begin + 16 + i]);
    return type == "vide";
}

}  // namespace

std::vector<std::byte> encode_panorama_png(const ImageU8& image) {
    PanoramaBytes file = encode_png(image);
    // An iTXt chunk: keyword, 0, not compressed, method 0, no language, no translation, text.
    PanoramaBytes chunk;
    append(chunk, "iTXtXML:com.adobe.xmp");
    append(chunk, std::string_view("\0\0\0\0\0", 5));
    append(chunk, photo_sphere_xmp(image.width, image.height));
    PanoramaBytes whole;
    append_u32(whole, static_cast<std::uint32_t>(chunk.size() - 4));
    whole.insert(whole.end(), chunk.begin(), chunk.end());
    append_u32(whole,
               static_cast<std::uint32_t>(crc32(0, reinterpret_cast<const Bytef*>(chunk.data()),
                                                static_cast<uInt>(chunk.size()))));
    constexpr std::ptrdiff_t kHead = 8 + 25;  // signature and IHDR, behind which it may stand
    file.insert(file.begin() + kHead, whole.begin(), whole.end());
    return file;
}

void write_panorama_png(const std::filesystem::path& path, const ImageU8& image) {
    write_file_atomic(path, encode_panorama_png(image));
}

namespace {

std::string_view text_of(std::span<const std::byte> bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Whether "ProjectionType" is followed by "equirectangular", as an attribute or an element.
bool says_equirectangular(std::string_view text) {
    constexpr std::string_view kName = "ProjectionType", kValue = "equirectangular";
    constexpr std::size_t kBetween = 8;  // =" or > and blanks
    for (std::size_t at = 0; (at = text.find(kName, at)) != std::string_view::npos;) {
        at += kName.size();
        if (text.substr(at, kBetween + kValue.size()).find(kValue) != std::string_view::npos)
            return true;
    }
    return false;
}

}  // namespace

bool is_marked_panorama(std::span<const std::byte> head) {
    return says_equirectangular(text_of(head));
}

bool is_marked_panorama_video(const std::filesystem::path& path) {
    constexpr std::uint64_t kMostIndex = 1 << 28;  // bytes; longer videos have some megabytes
    std::ifstream file(path, std::ios::binary);
    std::array<std::byte, 16> head{};
    std::uint64_t at = 0;
    while (file.seekg(static_cast<std::streamoff>(at)) &&
           file.read(reinterpret_cast<char*>(head.data()), head.size())) {
        std::uint64_t size = u32_at(head, 0);
        if (size == 1) size = std::uint64_t{u32_at(head, 8)} << 32 | u32_at(head, 12);
        if (size < 8) return false;
        if (text_of(head).substr(4, 4) != "moov") {
            if (size > std::numeric_limits<std::uint64_t>::max() / 2 - at) return false;
            at += size;
            continue;
        }
        std::string index(static_cast<std::size_t>(std::min(size, kMostIndex)), '\0');
        file.seekg(static_cast<std::streamoff>(at));
        file.read(index.data(), static_cast<std::streamsize>(index.size()));
        index.resize(static_cast<std::size_t>(file.gcount()));
        const std::size_t boxes = index.find("sv3d");
        return says_equirectangular(index) ||
               (boxes != std::string::npos && index.find("equi", boxes) != std::string::npos);
    }
    return false;
}

void mark_panorama_video(const std::filesystem::path& path) {
    const auto refuse = [&](const char* why) {
        throw Error(path.string(), why, "Make the video again with this machine's ffmpeg.");
    };
    PanoramaBytes file = read_file(path);
    const Box all{0, file.size()};
    const auto movie = find_box(file, all, "moov");
    if (!movie) refuse("is no MP4 with an index");
    if (const auto data = find_box(file, {movie->end, file.size()}, "mdat"); data)
        refuse("has its index before its pictures, whose places would change");
    std::optional<Box> track;
    for (Box rest = inside(*movie); (track = find_box(file, rest, "trak")); rest.begin = track->end)
        if (is_video(file, *track)) break;
    if (!track) refuse("has no video track");
    PanoramaBytes box;
    append_u32(box, static_cast<std::uint32_t>(8 + kSphericalId.size() + kSphericalVideo.size()));
    append(box, "uuid");
    for (const std::uint8_t byte : kSphericalId) box.push_back(static_cast<std::byte>(byte));
    append(box, kSphericalVideo);
    const auto longer = static_cast<std::uint32_t>(box.size());
    put_u32(file, track->begin, u32_at(file, track->begin) + longer);
    put_u32(file, movie->begin, u32_at(file, movie->begin) + longer);
    file.insert(file.begin() + static_cast<std::ptrdiff_t>(track->end), box.begin(), box.end());
    write_file_atomic(path, file);
}

}  // namespace darb
