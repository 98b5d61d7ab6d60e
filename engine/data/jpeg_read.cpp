// JPEG by libjpeg-turbo, with its accurate settings. What its warnings call corrupt data is an
// error here: the pixels behind it would be made up.
#include <fmt/format.h>

#include <csetjmp>
#include <cstdio>
// After cstdio, which it needs.
#include <jpeglib.h>
// After jpeglib.h.
#include <jerror.h>

#include <algorithm>
#include <array>
#include <vector>

#include "engine/core/error.h"
#include "engine/data/photo_decoder.h"

namespace darb {

namespace {

// Progressive files have about ten scans; each costs a walk over the whole photo, however few its
// bytes.
constexpr int kMostScans = 100;

/// libjpeg's state, and what ended it. Nothing that longjmp leaves has a destructor.
struct JpegReader {
    jpeg_decompress_struct state{};
    jpeg_error_mgr errors{};
    jpeg_progress_mgr progress{};
    std::jmp_buf failed{};
    std::array<char, JMSG_LENGTH_MAX> reason{};
    bool in_data = false;  // the head is read

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
    // Bytes between segments, versions and marks of applications, and the numbers in a scan's head
    // that mean nothing in a sequential file.
    return warning == JWRN_EXTRANEOUS_DATA || warning == JWRN_ADOBE_XFORM ||
           warning == JWRN_JFIF_MAJOR || warning == JWRN_NOT_SEQUENTIAL ||
           warning == JWRN_BOGUS_ICC;
}

void take_message(j_common_ptr state, int level) {
    if (level >= 0 || is_harmless(state->err->msg_code)) return;
    JpegReader& reader = reader_of(state);
    // Where all pixels are there before it, a missing end mark is harmless as well.
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
    if (setjmp(failed) != 0) return;  // out of memory; the next call fails as well
    jpeg_create_decompress(&state);
    state.progress = &progress;
    jpeg_mem_src(&state, reinterpret_cast<const unsigned char*>(file.data()),
                 static_cast<unsigned long>(file.size()));
}

/// Runs `work`; false where libjpeg ends it. Its locals are plain: longjmp runs no destructor.
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

/// A block of 8 x 8 px needs a bit of a file at least, its brightness'.
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

std::uint8_t product(unsigned a, unsigned b) {  // of parts of 255, rounded
    const unsigned t = a * b + 128;
    return static_cast<std::uint8_t>((t + (t >> 8)) >> 8);
}

/// Adobe's programs store inks as what they leave of white.
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
    s.do_block_smoothing = FALSE;  // which makes up what a progressive file leaves out
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

}  // namespace darb
