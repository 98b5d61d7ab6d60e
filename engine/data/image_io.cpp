// SPDX-License-Identifier: MIT
#include "engine/data/image_io.h"

#include <fmt/format.h>
#include <png.h>
#include <stb/stb_image_write.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <csetjmp>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <optional>
#include <string_view>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/data/gps.h"

namespace darb {

namespace {

constexpr std::size_t kHeadBytes = std::size_t{1}
                                   << 18;  // EXIF and ICC data come before the frame header

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
        throw Error("picture",
                    fmt::format("a picture of {}x{}x{} cannot be written", image.width,
                                image.height, image.channels),
                    "Give it a width, a height and channels.");
}

/// Called by stb_image_write with each piece of a file.
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
        throw Error("picture", fmt::format("there is no orientation {}", orientation),
                    "Exif counts them from 1 to 8.");
    if (orientation == 1) return image;
    const bool swap = orientation >= 5;
    const int w = image.width, h = image.height;
    ImageU8 turned(swap ? h : w, swap ? w : h, image.channels);
    const auto channels = static_cast<std::size_t>(image.channels);
    for (int y = 0; y < turned.height; ++y)
        for (int x = 0; x < turned.width; ++x) {
            // The stored pixel (u, v) that appears at (x, y).
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

// JPEG by libjpeg-turbo, with its accurate settings. Where its warnings speak of corrupt data, that
// is an error here: the pixels after it would be made up.

// Must follow cstdio.
#include <jpeglib.h>
// Must follow jpeglib.h.
#include <jerror.h>

namespace darb {

namespace {

// Progressive files have about ten scans. Each costs a pass over the whole photo, however few bytes
// it has.
constexpr int kMostScans = 100;

/// libjpeg's state, and the reason where it failed. Nothing that longjmp skips has a destructor.
struct JpegReader {
    jpeg_decompress_struct state{};
    jpeg_error_mgr errors{};
    jpeg_progress_mgr progress{};
    std::jmp_buf failed{};
    std::array<char, JMSG_LENGTH_MAX> reason{};
    bool in_data = false;  // the head has been read

    explicit JpegReader(std::span<const std::byte> file);
    ~JpegReader() { jpeg_destroy_decompress(&state); }
    JpegReader(const JpegReader&) = delete;
    JpegReader& operator=(const JpegReader&) = delete;
};

JpegReader& reader_of(j_common_ptr state) {
    return *static_cast<JpegReader*>(state->client_data);
}

[[noreturn]] void fail_jpeg(j_common_ptr state) {
    JpegReader& reader = reader_of(state);
    (*state->err->format_message)(state, reader.reason.data());
    std::longjmp(reader.failed, 1);
}

bool is_harmless(int warning) {
    // Harmless: bytes between segments, versions and marks of applications, and numbers in a scan's
    // head that mean nothing in a sequential file.
    return warning == JWRN_EXTRANEOUS_DATA || warning == JWRN_ADOBE_XFORM ||
           warning == JWRN_JFIF_MAJOR || warning == JWRN_NOT_SEQUENTIAL ||
           warning == JWRN_BOGUS_ICC;
}

void take_message(j_common_ptr state, int level) {
    if (level >= 0 || is_harmless(state->err->msg_code)) return;
    JpegReader& reader = reader_of(state);
    // Where all pixels come before it, a missing end marker is harmless as well.
    if (state->err->msg_code == JWRN_JPEG_EOF && reader.in_data &&
        !jpeg_has_multiple_scans(&reader.state))
        return;
    fail_jpeg(state);
}

void limit_scans(j_common_ptr state) {
    JpegReader& reader = reader_of(state);
    if (reader.state.input_scan_number <= kMostScans) return;
    fmt::format_to_n(reader.reason.data(), reader.reason.size() - 1, "more than {} scans",
                     kMostScans);
    std::longjmp(reader.failed, 1);
}

JpegReader::JpegReader(std::span<const std::byte> file) {
    state.err = jpeg_std_error(&errors);
    errors.error_exit = fail_jpeg;
    errors.emit_message = take_message;
    state.client_data = this;
    progress.progress_monitor = limit_scans;
    if (setjmp(failed) != 0) return;  // out of memory; the next call will fail, too
    jpeg_create_decompress(&state);
    state.progress = &progress;
    jpeg_mem_src(&state, reinterpret_cast<const unsigned char*>(file.data()),
                 static_cast<unsigned long>(file.size()));
}

/// Runs `work`; returns false where libjpeg fails. Its locals must be plain: longjmp runs no
/// destructors.
template <class Work>
bool run_jpeg(JpegReader& reader, const Work& work) {
    if (setjmp(reader.failed) != 0) return false;
    work();
    return true;
}

bool read_head(JpegReader& reader) {
    return run_jpeg(reader, [&] { jpeg_read_header(&reader.state, TRUE); });
}

int channels_of(const JpegReader& reader, const std::string& where) {
    const jpeg_decompress_struct& s = reader.state;
    if (s.arith_code || s.data_precision != 8)
        throw Error(where,
                    fmt::format("is a JPEG of {} bits{}: only 8 bits with Huffman codes are read",
                                s.data_precision, s.arith_code ? " with arithmetic coding" : ""),
                    kReplacePhoto);
    if (s.jpeg_color_space == JCS_GRAYSCALE) return 1;
    if (s.jpeg_color_space == JCS_UNKNOWN)
        throw Error(where,
                    fmt::format("is a JPEG of {} channels: 1, 3 and 4 are known", s.num_components),
                    kReplacePhoto);
    return 3;
}

/// A block of 8 x 8 px takes at least one bit of the file, for its brightness.
std::uint64_t least_jpeg_bytes(std::uint64_t width, std::uint64_t height) {
    return (width + 7) / 8 * ((height + 7) / 8) / 8;
}

PhotoHead checked_head(const JpegReader& reader, std::uint64_t bytes, const std::string& where) {
    const std::uint64_t width = reader.state.image_width, height = reader.state.image_height;
    PhotoHead head;
    head.channels = channels_of(reader, where);
    check_photo_claim(static_cast<std::int64_t>(width), static_cast<std::int64_t>(height),
                      least_jpeg_bytes(width, height), bytes, where);
    head.width = static_cast<int>(width);
    head.height = static_cast<int>(height);
    return head;
}

[[noreturn]] void refuse_jpeg(const JpegReader& reader, const std::string& where) {
    std::string place = "in its head";
    if (reader.in_data) {
        const jpeg_decompress_struct& s = reader.state;
        const unsigned row =
            s.output_scanline > 0
                ? s.output_scanline
                : std::min(s.input_iMCU_row * unsigned(s.max_v_samp_factor) * DCTSIZE,
                           s.image_height - 1);
        place = fmt::format("at row {} of {}", row, s.image_height);
        if (s.input_scan_number > 1) place += fmt::format(" of scan {}", s.input_scan_number);
    }
    throw Error(where, fmt::format("cannot be decoded: {}, {}", reader.reason.data(), place),
                kReplacePhoto);
}

std::uint8_t product(unsigned a, unsigned b) {  // product of two shares of 255, rounded
    const unsigned t = a * b + 128;
    return static_cast<std::uint8_t>((t + (t >> 8)) >> 8);
}

/// Adobe's programs store inks inverted: as what they leave of white.
void inks_to_rgb(const std::uint8_t* inks, std::uint8_t* rgb, std::size_t count, bool inverted) {
    for (std::size_t i = 0; i < count; ++i, inks += 4, rgb += 3)
        for (std::size_t c = 0; c < 3; ++c)
            rgb[c] = inverted ? product(inks[c], inks[3]) : product(255u - inks[c], 255u - inks[3]);
}

}  // namespace

bool is_jpeg(std::span<const std::byte> file) {
    return file.size() >= 3 && file[0] == std::byte{0xff} && file[1] == std::byte{0xd8} &&
           file[2] == std::byte{0xff};
}

PhotoHead jpeg_head(std::span<const std::byte> head, std::uint64_t bytes,
                    const std::string& where) {
    JpegReader reader(head);
    if (read_head(reader)) return checked_head(reader, bytes, where);
    if (head.size() < bytes) return {.cut = true};
    refuse_jpeg(reader, where);
}

ImageU8 decode_jpeg(std::span<const std::byte> file, const std::string& where) {
    JpegReader reader(file);
    if (!read_head(reader)) refuse_jpeg(reader, where);
    const PhotoHead head = checked_head(reader, file.size(), where);
    jpeg_decompress_struct& s = reader.state;
    const bool inks = s.num_components == 4;
    s.out_color_space = inks ? JCS_CMYK : head.channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
    s.dct_method = JDCT_ISLOW;
    s.do_fancy_upsampling = TRUE;
    s.do_block_smoothing = FALSE;  // smoothing would make up what a progressive file leaves out
    reader.in_data = true;
    ImageU8 image(head.width, head.height, head.channels);
    std::vector<std::uint8_t> ink_row(inks ? std::size_t{4} * head.width : 0);
    const std::size_t stride = static_cast<std::size_t>(head.width) * head.channels;
    const auto decode = [&] {
        jpeg_start_decompress(&s);
        while (s.output_scanline < s.output_height) {
            std::uint8_t* row = &image.data[s.output_scanline * stride];
            std::uint8_t* into = inks ? ink_row.data() : row;
            jpeg_read_scanlines(&s, &into, 1);
            if (inks) inks_to_rgb(into, row, s.output_width, s.saw_Adobe_marker != FALSE);
        }
        jpeg_finish_decompress(&s);
    };
    if (!run_jpeg(reader, decode)) refuse_jpeg(reader, where);
    return image;
}

// PNG by libpng. Pixels are taken as stored, without gamma or colour profiles. The checksum of
// every chunk must be right.

namespace {

struct PngReader {
    png_structp png = nullptr;
    png_infop info = nullptr;
    std::span<const std::byte> file;
    std::size_t at = 0;
    std::uint32_t row = 0;  // the row being read
    bool cut = false;       // the bytes ended too early
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

/// Treats those of libpng's warnings as errors that mean changed pixels.
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

/// Runs `work`; returns false where libpng fails. Its locals must be plain: longjmp runs no
/// destructors.
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
        // Chunks that say nothing about the pixels are checked and skipped, never unpacked.
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

/// Deflate packs at most 1,032 bytes into one; each row begins with a byte for its filter.
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
        png_set_expand(reader.png);  // expands palettes, 1 to 4 bits, and a transparent colour
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
    std::size_t value = 0;  // offset of the value, or of the offset of a longer one
};

/// tiff: begins with the byte order mark. A directory is a count followed by 12-byte entries: tag,
/// type, count, value. Returns nothing where the tag is missing.
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

/// Whether this is TIFF data; also sets its byte order.
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

/// `count` unsigned rationals of a directory's entry; nothing where there are fewer, or one is
/// divided by 0.
template <std::size_t count>
std::optional<std::array<double, count>> rationals(Bytes tiff, std::size_t directory,
                                                   std::uint32_t tag, bool little) {
    constexpr std::uint32_t kRational = 5;
    const auto entry = find_entry(tiff, directory, tag, little);
    if (!entry || entry->type != kRational || entry->count < count) return {};
    const std::size_t at = read_uint(tiff, entry->value, 4, little);
    if (at > tiff.size() || tiff.size() - at < 8 * count) return {};
    std::array<double, count> values;
    for (std::size_t i = 0; i < count; ++i) {
        const double divisor = read_uint(tiff, at + 8 * i + 4, 4, little);
        if (divisor == 0) return {};
        values[i] = read_uint(tiff, at + 8 * i, 4, little) / divisor;
    }
    return values;
}

std::optional<GeoPosition> tiff_position(Bytes tiff) {
    constexpr std::uint32_t kGpsTag = 0x8825, kLatitudeRef = 1, kLatitude = 2, kLongitudeRef = 3,
                            kLongitude = 4, kAltitudeRef = 5, kAltitude = 6;
    bool little = false;
    if (!is_tiff(tiff, little)) return {};
    const auto gps = find_entry(tiff, read_uint(tiff, 4, 4, little), kGpsTag, little);
    if (!gps) return {};
    const std::size_t directory = read_uint(tiff, gps->value, 4, little);
    const auto letter = [&](std::uint32_t tag) {
        const auto entry = find_entry(tiff, directory, tag, little);
        return entry ? static_cast<char>(tiff[entry->value]) : '\0';
    };
    const auto latitude = rationals<3>(tiff, directory, kLatitude, little);
    const auto longitude = rationals<3>(tiff, directory, kLongitude, little);
    const auto altitude = rationals<1>(tiff, directory, kAltitude, little);
    if (!latitude || !longitude || !altitude) return {};
    const auto degrees = [](const std::array<double, 3>& parts) {
        return parts[0] + parts[1] / 60 + parts[2] / 3600;
    };
    GeoPosition position{degrees(*latitude), degrees(*longitude), (*altitude)[0]};
    if (position.latitude > 90 || position.longitude > 180) return {};
    if (position.latitude == 0 && position.longitude == 0)
        return {};  // as cameras without a fix write
    if (letter(kLatitudeRef) == 'S') position.latitude *= -1;
    if (letter(kLongitudeRef) == 'W') position.longitude *= -1;
    if (letter(kAltitudeRef) == 1) position.altitude *= -1;  // below the sea
    return position;
}

/// What follows "Exif" in the file; empty where there is none.
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

std::optional<GeoPosition> exif_position(Bytes file) {
    return tiff_position(exif_of(file));
}

namespace {

std::uint8_t to_byte(float value) {
    return static_cast<std::uint8_t>(std::clamp(value + 0.5f, 0.0f, 255.0f));
}

/// Which source pixels a target pixel covers, and how much of each.
struct Coverage {
    int first = 0;
    std::vector<float> weight;  // sums to 1
};

std::vector<Coverage> cover(int source, int target) {
    std::vector<Coverage> all(static_cast<std::size_t>(target));
    const double step = static_cast<double>(source) / target;
    for (int i = 0; i < target; ++i) {
        Coverage& one = all[static_cast<std::size_t>(i)];
        const double begin = i * step, end = std::min<double>((i + 1) * step, source);
        one.first = std::min(static_cast<int>(begin), source - 1);
        for (int at = one.first; at < source && at < end; ++at) {
            const double covered = std::min(end, at + 1.0) - std::max<double>(begin, at);
            if (at > one.first && covered < 1e-9) break;
            one.weight.push_back(static_cast<float>(covered / step));
        }
    }
    return all;
}

/// One source row, premultiplied, reduced to the target's width: [width][4].
void reduce_row(const std::uint8_t* from, const std::vector<Coverage>& columns, float* to) {
    for (const Coverage& column : columns) {
        float sum[4] = {0, 0, 0, 0};
        const std::uint8_t* pixel = from + std::size_t{4} * static_cast<std::size_t>(column.first);
        for (const float weight : column.weight) {
            const float alpha = weight * static_cast<float>(pixel[3]);
            for (int c = 0; c < 3; ++c) sum[c] += alpha * static_cast<float>(pixel[c]);
            sum[3] += alpha;
            pixel += 4;
        }
        for (const float value : sum) *to++ = value;
    }
}

}  // namespace

ImageU8 to_rgba(ImageU8 image) {
    if (image.channels == 4) return image;
    ImageU8 rgba(image.width, image.height, 4);
    const auto channels = static_cast<std::size_t>(image.channels);
    const std::size_t pixels = image.data.size() / channels;
    for (std::size_t i = 0; i < pixels; ++i) {
        for (std::size_t c = 0; c < 3; ++c)
            rgba.data[i * 4 + c] = image.data[i * channels + (channels == 1 ? 0 : c)];
        rgba.data[i * 4 + 3] = 255;
    }
    return rgba;
}

namespace {

/// The values of a mask, 0 to 255. They are in its colour, where 0 and 1 may stand for 0 and 255.
/// Where the alpha channel varies, they are there; where the colour is black and white as well, in
/// both.
class MaskValues {
  public:
    explicit MaskValues(const ImageU8& mask)
        : mask_(mask), channels_(static_cast<std::size_t>(mask.channels)) {
        int least = 255, most = 0, clear = 255, opaque = 0;
        for (std::size_t i = 0; i + channels_ <= mask.data.size(); i += channels_) {
            const std::uint8_t* at = &mask.data[i];
            least = std::min<int>(least, at[0]);
            most = std::max<int>(most, at[0]);
            if (channels_ != 4) continue;
            clear = std::min<int>(clear, at[3]);
            opaque = std::max<int>(opaque, at[3]);
        }
        scale_ = most == 1 ? 255 : 1;
        by_alpha_ = clear < opaque;
        by_colour_ = !by_alpha_ || (least < most && is_black_and_white());
    }

    int at(std::size_t pixel) const {
        const std::uint8_t* at = &mask_.data[pixel * channels_];
        const int colour = by_colour_ ? scale_ * at[0] : 255;
        return by_alpha_ ? (colour * at[3] + 127) / 255 : colour;
    }

  private:
    bool is_black_and_white() const {
        constexpr int kNear = 8;
        for (std::size_t i = 0; i < mask_.data.size(); i += channels_)
            for (std::size_t c = 0; c < 3; ++c)
                if (mask_.data[i + c] > kNear && mask_.data[i + c] < 255 - kNear) return false;
        return true;
    }

    const ImageU8& mask_;
    std::size_t channels_;
    int scale_ = 1;
    bool by_alpha_ = false, by_colour_ = true;
};

}  // namespace

void apply_mask(ImageU8& rgba, const ImageU8& mask) {
    if (rgba.channels != 4 || mask.width <= 0 || mask.height <= 0)
        throw Error("mask",
                    fmt::format("cannot apply {}x{} px to a photo of {} channels", mask.width,
                                mask.height, rgba.channels),
                    "Use RGBA photos and masks that are not empty.");
    const MaskValues values(mask);
    for (int y = 0; y < rgba.height; ++y) {
        const auto v = static_cast<std::size_t>((y + 0.5) * mask.height / rgba.height);
        for (int x = 0; x < rgba.width; ++x) {
            const auto u = static_cast<std::size_t>((x + 0.5) * mask.width / rgba.width);
            const int value = values.at(v * static_cast<std::size_t>(mask.width) + u);
            std::uint8_t& alpha = rgba.data[(static_cast<std::size_t>(y) * rgba.width + x) * 4 + 3];
            alpha = static_cast<std::uint8_t>((alpha * value + 127) / 255);
        }
    }
}

ImageU8 box_downscale(const ImageU8& rgba, int width, int height) {
    if (rgba.channels != 4 || width < 1 || height < 1 || width > rgba.width || height > rgba.height)
        throw Error("downscale",
                    fmt::format("cannot turn {}x{}x{} into {}x{}", rgba.width, rgba.height,
                                rgba.channels, width, height),
                    "Use RGBA, and a size of at least 1 px and at most the photo's.");
    if (width == rgba.width && height == rgba.height) return rgba;
    const std::vector<Coverage> columns = cover(rgba.width, width);
    const std::vector<Coverage> rows = cover(rgba.height, height);
    const std::size_t row_values = std::size_t{4} * static_cast<std::size_t>(width);
    const std::size_t stride = std::size_t{4} * static_cast<std::size_t>(rgba.width);
    std::vector<float> reduced(row_values), sum(row_values);
    ImageU8 out(width, height, 4);
    int reduced_row = -1;  // neighbouring targets share a source row where sizes do not divide
    for (std::size_t y = 0; y < rows.size(); ++y) {
        std::fill(sum.begin(), sum.end(), 0.0f);
        for (std::size_t i = 0; i < rows[y].weight.size(); ++i) {
            const int source = rows[y].first + static_cast<int>(i);
            if (source != reduced_row)
                reduce_row(&rgba.data[static_cast<std::size_t>(source) * stride], columns,
                           reduced.data());
            reduced_row = source;
            const float weight = rows[y].weight[i];
            for (std::size_t k = 0; k < row_values; ++k) sum[k] += weight * reduced[k];
        }
        std::uint8_t* to = &out.data[y * row_values];
        for (std::size_t k = 0; k < row_values; k += 4) {
            const float alpha = sum[k + 3], scale = alpha > 0 ? 1 / alpha : 0;
            for (std::size_t c = 0; c < 3; ++c) to[k + c] = to_byte(sum[k + c] * scale);
            to[k + 3] = to_byte(alpha);
        }
    }
    return out;
}

}  // namespace darb
