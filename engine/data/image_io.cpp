#include "engine/data/image_io.h"

#include <fmt/format.h>
#include <stb/stb_image.h>
#include <stb/stb_image_write.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <limits>
#include <memory>
#include <vector>

#include "engine/core/check.h"
#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/data/exif.h"

namespace darb {

namespace {

constexpr std::size_t kHeadBytes = std::size_t{1}
                                   << 18;  // EXIF and ICC come before the frame header
constexpr const char* kReplace = "Replace the file by a PNG or JPEG that an image viewer opens.";

constexpr std::string_view kPhotoExtensions[] = {".png", ".jpg", ".jpeg"};
constexpr std::string_view kForeignExtensions[] = {".webp", ".tif",  ".tiff",
                                                   ".bmp",  ".heic", ".heif"};

bool has_one_of(const std::filesystem::path& path, std::span<const std::string_view> extensions) {
    return std::ranges::any_of(extensions,
                               [&](std::string_view e) { return has_extension(path, e); });
}

const stbi_uc* raw(std::span<const std::byte> bytes) {
    return reinterpret_cast<const stbi_uc*>(bytes.data());
}

int length_of(std::span<const std::byte> bytes, const std::string& where) {
    if (bytes.size() > std::numeric_limits<int>::max())
        throw Error(where, "is larger than 2 GiB", kReplace);
    return static_cast<int>(bytes.size());
}

/// Whether a PNG has a chunk tRNS, which makes one colour transparent; before the first IDAT.
bool has_transparent_colour(std::span<const std::byte> file) {
    constexpr std::size_t kSignature = 8, kChunk = 12;  // length, type, checksum
    constexpr unsigned char kBegin[kSignature] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    if (file.size() < kSignature || std::memcmp(file.data(), kBegin, kSignature) != 0) return false;
    for (std::size_t at = kSignature; at + kChunk <= file.size();) {
        std::size_t length = 0;
        for (std::size_t i = 0; i < 4; ++i)
            length = length << 8 | static_cast<std::size_t>(file[at + i]);
        const std::string_view type(reinterpret_cast<const char*>(&file[at + 4]), 4);
        if (type == "tRNS") return true;
        if (type == "IDAT" || length > file.size()) return false;
        at += kChunk + length;
    }
    return false;
}

bool parse_info(std::span<const std::byte> head, const std::string& where, ImageInfo& info) {
    info.orientation = exif_orientation(head);
    if (!stbi_info_from_memory(raw(head), length_of(head, where), &info.width, &info.height,
                               &info.channels))
        return false;
    // stb counts the alpha of a palette alone.
    if (info.channels % 2 == 1 && has_transparent_colour(head)) ++info.channels;
    return true;
}

void check_picture(const ImageU8& image) {
    DARB_CHECK(image.width > 0 && image.height > 0 && image.channels >= 1, "{}x{}x{}", image.width,
               image.height, image.channels);
}

/// What stb_image_write calls with each piece of a file.
void append_bytes(void* context, void* data, int size) {
    auto* out = static_cast<std::vector<std::byte>*>(context);
    const auto* bytes = static_cast<const std::byte*>(data);
    out->insert(out->end(), bytes, bytes + size);
}

}  // namespace

bool is_photo_name(const std::filesystem::path& path) {
    return has_one_of(path, kPhotoExtensions);
}

bool is_foreign_picture_name(const std::filesystem::path& path) {
    return has_one_of(path, kForeignExtensions);
}

std::filesystem::path without_picture_extension(const std::filesystem::path& path) {
    const bool picture = is_photo_name(path) || is_foreign_picture_name(path);
    return picture ? std::filesystem::path(path).replace_extension() : path;
}

ImageInfo read_image_info(const std::filesystem::path& path) {
    std::vector<std::byte> head(kHeadBytes);
    std::ifstream file(path, std::ios::binary);
    if (!file)
        throw Error(path.string(), "cannot be opened", "Check the path and its permissions.");
    file.read(reinterpret_cast<char*>(head.data()), static_cast<std::streamsize>(head.size()));
    head.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
    ImageInfo info;
    if (parse_info(head, path.string(), info)) return info;
    if (head.size() == kHeadBytes && parse_info(read_file(path), path.string(), info)) return info;
    throw Error(path.string(), "is no PNG or JPEG, or is damaged", kReplace);
}

ImageU8 decode_image(std::span<const std::byte> file, const std::string& where, int orientation) {
    int width = 0, height = 0, stored = 0;
    const int length = length_of(file, where);
    if (!stbi_info_from_memory(raw(file), length, &width, &height, &stored))
        throw Error(where, "is no PNG or JPEG, or is damaged", kReplace);
    if (stored % 2 == 1 && has_transparent_colour(file)) ++stored;
    const int wanted = stored == 2 ? 4 : stored;
    const std::unique_ptr<stbi_uc, void (*)(void*)> pixels(
        stbi_load_from_memory(raw(file), length, &width, &height, &stored, wanted),
        stbi_image_free);
    if (!pixels)
        throw Error(where, fmt::format("cannot be decoded: {}", stbi_failure_reason()), kReplace);
    ImageU8 image(width, height, wanted);
    std::copy_n(pixels.get(), image.data.size(), image.data.begin());
    return orient_image(image,
                        orientation == kExifOrientation ? exif_orientation(file) : orientation);
}

ImageU8 read_image(const std::filesystem::path& path, int orientation) {
    return decode_image(read_file(path), path.string(), orientation);
}

ImageU8 orient_image(const ImageU8& image, int orientation) {
    DARB_CHECK(orientation >= 1 && orientation <= 8, "orientation {}", orientation);
    if (orientation == 1) return image;
    const bool swap = orientation >= 5;
    const int w = image.width, h = image.height;
    ImageU8 turned(swap ? h : w, swap ? w : h, image.channels);
    const auto channels = static_cast<std::size_t>(image.channels);
    for (int y = 0; y < turned.height; ++y)
        for (int x = 0; x < turned.width; ++x) {
            // Stored pixel (u, v) that is seen at (x, y).
            int u = swap ? y : x, v = swap ? x : y;
            if (orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8)
                u = w - 1 - u;
            if (orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7)
                v = h - 1 - v;
            const std::size_t from = (static_cast<std::size_t>(v) * w + u) * channels;
            const std::size_t to = (static_cast<std::size_t>(y) * turned.width + x) * channels;
            std::copy_n(&image.data[from], channels, &turned.data[to]);
        }
    return turned;
}

std::vector<std::byte> encode_png(const ImageU8& image) {
    check_picture(image);
    std::vector<std::byte> file;
    if (!stbi_write_png_to_func(append_bytes, &file, image.width, image.height, image.channels,
                                image.data.data(), image.width * image.channels))
        throw Error("a picture", "the PNG cannot be encoded", "Free memory.");
    return file;
}

std::vector<std::byte> encode_jpeg(const ImageU8& image, int quality) {
    check_picture(image);
    std::vector<std::byte> file;
    if (!stbi_write_jpg_to_func(append_bytes, &file, image.width, image.height, image.channels,
                                image.data.data(), quality))
        throw Error("a picture", "the JPEG cannot be encoded", "Free memory.");
    return file;
}

void write_png(const std::filesystem::path& path, const ImageU8& image) {
    write_file_atomic(path, encode_png(image));
}

std::string picture_name(const std::string& view_name, std::set<std::string>& used) {
    std::string stem = without_picture_extension(view_name).string();
    std::replace_if(
        stem.begin(), stem.end(), [](char c) { return c == '/' || c == '\\'; }, '_');
    if (stem.empty()) stem = "view";
    std::string name = stem;
    for (int n = 2; !used.insert(name).second; ++n) name = fmt::format("{}_{}", stem, n);
    return name + ".png";
}

}  // namespace darb
