// PNG by libpng. Pixels are taken as they are stored: no gamma, no colour profile. Every chunk's
// checksum counts.
#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>
#include <vector>

#include "engine/core/check.h"
#include "engine/core/error.h"
#include "engine/data/photo_decoder.h"

namespace darb {

namespace {

struct PngReader {
    png_structp png = nullptr;
    png_infop info = nullptr;
    std::span<const std::byte> file;
    std::size_t at = 0;
    std::uint32_t row = 0;  // that is read
    bool cut = false;       // the bytes ended
    std::array<char, 200> reason{};

    explicit PngReader(std::span<const std::byte> file_);
    ~PngReader() { png_destroy_read_struct(&png, &info, nullptr); }
    PngReader(const PngReader&) = delete;
    PngReader& operator=(const PngReader&) = delete;
};

[[noreturn]] void fail_png(png_structp png, png_const_charp message) {
    auto& reader = *static_cast<PngReader*>(png_get_error_ptr(png));
    std::strncpy(reader.reason.data(), message, reader.reason.size() - 1);
    png_longjmp(png, 1);
}

/// Of what libpng would go on with, that is an error which changes pixels.
void take_warning(png_structp png, png_const_charp message) {
    const std::string_view text(message);
    const bool pixels = text.starts_with("IDAT") || text.starts_with("tRNS");
    if (pixels && text != "IDAT: Too much image data") fail_png(png, message);
}

void read_png_bytes(png_structp png, png_bytep to, std::size_t count) {
    auto& reader = *static_cast<PngReader*>(png_get_io_ptr(png));
    if (count > reader.file.size() - reader.at) {
        reader.cut = true;
        png_error(png, "the file ends here");
    }
    std::memcpy(to, reader.file.data() + reader.at, count);
    reader.at += count;
}

/// Runs `work`; false where libpng ends it. Its locals are plain: longjmp runs no destructor.
template <class Work>
bool run_png(PngReader& reader, const Work& work) {
    if (!reader.png || !reader.info) {
        std::strncpy(reader.reason.data(), "out of memory", reader.reason.size() - 1);
        return false;
    }
    if (setjmp(png_jmpbuf(reader.png)) != 0) return false;
    work();
    return true;
}

PngReader::PngReader(std::span<const std::byte> file_) : file(file_) {
    png = png_create_read_struct(PNG_LIBPNG_VER_STRING, this, fail_png, take_warning);
    if (!png) return;
    info = png_create_info_struct(png);
    png_set_read_fn(png, this, read_png_bytes);
    run_png(*this, [this] {
        png_set_user_limits(png, kMostPhotoSide, kMostPhotoSide);
        // Chunks that say nothing about the pixels are checked and passed over, never unpacked.
        png_set_keep_unknown_chunks(png, PNG_HANDLE_CHUNK_NEVER, nullptr, -1);
        png_set_crc_action(png, PNG_CRC_ERROR_QUIT, PNG_CRC_ERROR_QUIT);
    });
}

[[noreturn]] void refuse_png(const PngReader& reader, const std::string& where) {
    const std::string place = reader.row == 0 ? fmt::format("at byte {}", reader.at)
                                              : fmt::format("at row {}", reader.row);
    throw Error(where, fmt::format("cannot be decoded: {}, {}", reader.reason.data(), place),
                kReplacePhoto);
}

bool read_head(PngReader& reader) {
    return run_png(reader, [&] { png_read_info(reader.png, reader.info); });
}

/// Deflate packs at most 1,032 bytes in one; a row begins with its filter's byte.
std::uint64_t least_png_bytes(std::uint64_t height, std::uint64_t row_bytes) {
    return (row_bytes + 1) * height / 1032;
}

PhotoHead checked_head(const PngReader& reader, std::uint64_t bytes, const std::string& where) {
    const png_uint_32 width = png_get_image_width(reader.png, reader.info);
    const png_uint_32 height = png_get_image_height(reader.png, reader.info);
    check_photo_claim(width, height,
                      least_png_bytes(height, png_get_rowbytes(reader.png, reader.info)), bytes,
                      where);
    const int type = png_get_color_type(reader.png, reader.info);
    const bool alpha = (type & PNG_COLOR_MASK_ALPHA) != 0 ||
                       png_get_valid(reader.png, reader.info, PNG_INFO_tRNS) != 0;
    PhotoHead head;
    head.width = static_cast<int>(width);
    head.height = static_cast<int>(height);
    head.channels = ((type & PNG_COLOR_MASK_COLOR) != 0 ? 3 : 1) + (alpha ? 1 : 0);
    return head;
}

void decode_rows(PngReader& reader, png_bytep to, std::size_t stride, int height,
                 const std::string& where) {
    const int passes =
        png_get_interlace_type(reader.png, reader.info) == PNG_INTERLACE_ADAM7 ? 7 : 1;
    const auto decode = [&] {
        for (int pass = 0; pass < passes; ++pass)
            for (reader.row = 0; reader.row < static_cast<std::uint32_t>(height); ++reader.row)
                png_read_row(reader.png, to + reader.row * stride, nullptr);
        reader.row = 0;
        png_read_end(reader.png, nullptr);
    };
    if (!run_png(reader, decode)) refuse_png(reader, where);
}

}  // namespace

bool is_png(std::span<const std::byte> file) {
    return file.size() >= 8 &&
           png_sig_cmp(reinterpret_cast<png_const_bytep>(file.data()), 0, 8) == 0;
}

PhotoHead png_head(std::span<const std::byte> head, std::uint64_t bytes, const std::string& where) {
    PngReader reader(head);
    if (read_head(reader)) return checked_head(reader, bytes, where);
    if (reader.cut && head.size() < bytes) return {.cut = true};
    refuse_png(reader, where);
}

ImageU8 decode_png(std::span<const std::byte> file, const std::string& where) {
    PngReader reader(file);
    if (!read_head(reader)) refuse_png(reader, where);
    const PhotoHead head = checked_head(reader, file.size(), where);
    const int channels = head.channels == 2 ? 4 : head.channels;
    const auto prepare = [&] {
        png_set_expand(reader.png);  // palettes, 1 to 4 bits, a transparent colour
        png_set_strip_16(reader.png);
        if (head.channels == 2) png_set_gray_to_rgb(reader.png);
        png_set_interlace_handling(reader.png);
        png_read_update_info(reader.png, reader.info);
    };
    if (!run_png(reader, prepare)) refuse_png(reader, where);
    ImageU8 image(head.width, head.height, channels);
    const std::size_t stride = static_cast<std::size_t>(head.width) * channels;
    DARB_CHECK(png_get_rowbytes(reader.png, reader.info) == stride, "{} channels", channels);
    decode_rows(reader, image.data.data(), stride, head.height, where);
    return image;
}

GreyU16 decode_png16(std::span<const std::byte> file, const std::string& where,
                     const std::string& hint) {
    PngReader reader(file);
    if (!read_head(reader)) refuse_png(reader, where);
    const PhotoHead head = checked_head(reader, file.size(), where);
    const int depth = png_get_bit_depth(reader.png, reader.info);
    if (depth != 16 || head.channels != 1)
        throw Error(where, fmt::format("has {} bits and {} channels", depth, head.channels), hint);
    const auto prepare = [&] {
        png_set_swap(reader.png);  // to little-endian
        png_set_interlace_handling(reader.png);
        png_read_update_info(reader.png, reader.info);
    };
    if (!run_png(reader, prepare)) refuse_png(reader, where);
    GreyU16 image{head.width, head.height, {}};
    image.data.resize(static_cast<std::size_t>(head.width) * head.height);
    decode_rows(reader, reinterpret_cast<png_bytep>(image.data.data()),
                static_cast<std::size_t>(head.width) * 2, head.height, where);
    return image;
}

}  // namespace darb
