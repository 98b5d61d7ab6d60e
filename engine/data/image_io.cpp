#include "engine/data/image_io.h"

#include <fmt/format.h>
#include <stb/stb_image_write.h>

#include <algorithm>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/data/exif.h"
#include "engine/data/photo_decoder.h"

namespace darb {

namespace {

constexpr std::size_t kHeadBytes = std::size_t{1}
                                   << 18;  // EXIF and ICC come before the frame header

constexpr std::string_view kPhotoExtensions[] = {".png", ".jpg", ".jpeg"};
constexpr std::string_view kForeignExtensions[] = {".webp", ".tif",  ".tiff",
                                                   ".bmp",  ".heic", ".heif"};

bool has_one_of(const std::filesystem::path& path, std::span<const std::string_view> extensions) {
    return std::ranges::any_of(extensions,
                               [&](std::string_view e) { return has_extension(path, e); });
}

[[noreturn]] void refuse_picture(std::span<const std::byte> head, const std::string& where) {
    throw Error(where, head.empty() ? "is empty" : "is no PNG or JPEG", kReplacePhoto);
}

/// head: the first part of a file of `bytes` bytes, or all of it.
PhotoHead photo_head(std::span<const std::byte> head, std::uint64_t bytes,
                     const std::string& where) {
    if (is_jpeg(head)) return jpeg_head(head, bytes, where);
    if (is_png(head)) return png_head(head, bytes, where);
    refuse_picture(head, where);
}

void check_picture(const ImageU8& image) {
    if (image.width <= 0 || image.height <= 0 || image.channels < 1)
        throw Error(
            "picture",
            fmt::format("{}x{}x{} is nothing to write", image.width, image.height, image.channels),
            "Give it a width, a height and channels.");
}

/// What stb_image_write calls with each piece of a file.
void append_bytes(void* context, void* data, int size) {
    auto* out = static_cast<std::vector<std::byte>*>(context);
    const auto* bytes = static_cast<const std::byte*>(data);
    out->insert(out->end(), bytes, bytes + size);
}

}  // namespace

void check_photo_claim(std::int64_t width, std::int64_t height, std::uint64_t least,
                       std::uint64_t bytes, const std::string& where) {
    const auto refuse = [&](const std::string& why) {
        throw Error(where, fmt::format("claims {} x {} px, {}", width, height, why), kReplacePhoto);
    };
    if (width < 1 || height < 1) refuse("which is no picture");
    if (std::max(width, height) > kMostPhotoSide || width * height > kMostPhotoPixels)
        refuse(fmt::format("beyond the limit of {} million", kMostPhotoPixels / 1'000'000));
    if (least > bytes)
        refuse(fmt::format("which takes {} bytes at least, but the file has {}", least, bytes));
}

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
    std::vector<std::byte> head = read_file_head(path, kHeadBytes);
    const std::uint64_t bytes =
        head.size() < kHeadBytes ? head.size() : std::filesystem::file_size(path);
    PhotoHead found = photo_head(head, bytes, path.string());
    if (found.cut) {
        head = read_file(path);
        found = photo_head(head, head.size(), path.string());
    }
    return {found.width, found.height, found.channels, exif_orientation(head),
            exif_focal_35mm(head)};
}

ImageInfo parse_image_info(std::span<const std::byte> file, const std::string& where) {
    const PhotoHead found = photo_head(file, file.size(), where);
    return {found.width, found.height, found.channels, exif_orientation(file),
            exif_focal_35mm(file)};
}

ImageU8 decode_image(std::span<const std::byte> file, const std::string& where, int orientation) {
    if (!is_jpeg(file) && !is_png(file)) refuse_picture(file, where);
    const ImageU8 image = is_jpeg(file) ? decode_jpeg(file, where) : decode_png(file, where);
    return orient_image(image,
                        orientation == kExifOrientation ? exif_orientation(file) : orientation);
}

ImageU8 read_image(const std::filesystem::path& path, int orientation) {
    return decode_image(read_file(path), path.string(), orientation);
}

ImageU8 orient_image(const ImageU8& image, int orientation) {
    if (orientation < 1 || orientation > 8)
        throw Error("picture", fmt::format("no orientation {}", orientation),
                    "Exif counts them from 1 to 8.");
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
