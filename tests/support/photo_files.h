// SPDX-License-Identifier: MIT
// PNG and JPEG files of every kind that cameras and programs write, by the libraries' own encoders.
#pragma once

#include <png.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>
#include <utility>
#include <vector>
// After cstdio, which it needs.
#include <jpeglib.h>

namespace darb::test {

/// A slope in x and y with some texture, [height][width][channels].
inline std::vector<std::uint8_t> slope(int width, int height, int channels) {
    std::vector<std::uint8_t> pixels;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < channels; ++c)
                pixels.push_back(static_cast<std::uint8_t>(
                    (x * (5 + c) + y * (9 - 2 * c) + (x * y * (c + 1) % 7) * 6 + 40 * c) % 256));
    return pixels;
}

struct JpegKind {
    int width = 16, height = 12;
    int channels = 3;  // 1, 3, or 4: CMYK as Adobe's programs write it
    bool progressive = false;
    int restart = 0;      // blocks between restart markers; 0 = none
    int sampling = 2;     // 2: colour at half the size; 1: at all of it
    bool as_rgb = false;  // no YCbCr
    bool arithmetic = false;
    int scans = 0;  // progressive: so many scans of one coefficient at most; 0 = libjpeg's own
};

inline std::vector<std::byte> jpeg_file(const JpegKind& kind) {
    jpeg_compress_struct state{};
    jpeg_error_mgr errors{};
    state.err = jpeg_std_error(&errors);
    jpeg_create_compress(&state);
    unsigned char* out = nullptr;
    unsigned long size = 0;
    jpeg_mem_dest(&state, &out, &size);
    state.image_width = static_cast<JDIMENSION>(kind.width);
    state.image_height = static_cast<JDIMENSION>(kind.height);
    state.input_components = kind.channels;
    state.in_color_space = kind.channels == 1   ? JCS_GRAYSCALE
                           : kind.channels == 3 ? JCS_RGB
                                                : JCS_CMYK;
    jpeg_set_defaults(&state);
    if (kind.as_rgb) jpeg_set_colorspace(&state, JCS_RGB);
    jpeg_set_quality(&state, 90, TRUE);
    state.comp_info[0].h_samp_factor = state.comp_info[0].v_samp_factor = kind.sampling;
    state.restart_interval = static_cast<unsigned>(kind.restart);
    state.arith_code = kind.arithmetic ? TRUE : FALSE;
    std::vector<jpeg_scan_info> script;
    if (kind.progressive) jpeg_simple_progression(&state);
    if (kind.scans > 0) {
        // One coefficient a scan of grey, each bit by itself.
        script.push_back({1, {0, 0, 0, 0}, 0, 0, 0, 0});
        for (int k = 1; k < 64; ++k)
            for (int bit = 3; bit >= 0; --bit)
                if (static_cast<int>(script.size()) < kind.scans)
                    script.push_back({1, {0, 0, 0, 0}, k, k, bit == 3 ? 0 : bit + 1, bit});
        state.scan_info = script.data();
        state.num_scans = static_cast<int>(script.size());
    }
    jpeg_start_compress(&state, TRUE);
    const std::vector<std::uint8_t> pixels = slope(kind.width, kind.height, kind.channels);
    while (state.next_scanline < state.image_height) {
        auto* row = const_cast<std::uint8_t*>(
            &pixels[std::size_t{state.next_scanline} * kind.width * kind.channels]);
        jpeg_write_scanlines(&state, &row, 1);
    }
    jpeg_finish_compress(&state);
    jpeg_destroy_compress(&state);
    const auto* begin = reinterpret_cast<const std::byte*>(out);
    std::vector<std::byte> file(begin, begin + size);
    std::free(out);
    return file;
}

struct PngKind {
    int type = PNG_COLOR_TYPE_RGB;
    int depth = 8;
    bool transparent = false;  // a chunk tRNS
    bool interlaced = false;
    double gamma = 0;  // a chunk gAMA; 0 = none
    int width = 9, height = 7;
};

/// Its pixels are slope's, as many bytes a row as the kind takes.
inline std::vector<std::byte> png_file(const PngKind& kind) {
    std::vector<std::byte> file;
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    png_set_write_fn(
        png, &file,
        [](png_structp p, png_bytep data, std::size_t count) {
            auto* to = static_cast<std::vector<std::byte>*>(png_get_io_ptr(p));
            const auto* from = reinterpret_cast<const std::byte*>(data);
            to->insert(to->end(), from, from + count);
        },
        [](png_structp) {});
    png_set_IHDR(png, info, static_cast<png_uint_32>(kind.width),
                 static_cast<png_uint_32>(kind.height), kind.depth, kind.type,
                 kind.interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    std::vector<png_color> palette;
    if (kind.type == PNG_COLOR_TYPE_PALETTE) {
        for (int i = 0; i < 1 << kind.depth; ++i)
            palette.push_back({static_cast<png_byte>(i * 3), static_cast<png_byte>(255 - i),
                               static_cast<png_byte>(i * 7)});
        png_set_PLTE(png, info, palette.data(), static_cast<int>(palette.size()));
    }
    png_byte alphas[2] = {0, 100};
    png_color_16 colour{1, 40, 50, 60, static_cast<png_uint_16>(kind.depth < 2 ? 1 : 3)};
    if (kind.transparent) png_set_tRNS(png, info, alphas, palette.empty() ? 0 : 2, &colour);
    if (kind.gamma > 0) png_set_gAMA(png, info, kind.gamma);
    png_write_info(png, info);
    const std::size_t stride = png_get_rowbytes(png, info);
    std::vector<std::uint8_t> pixels = slope(static_cast<int>(stride), kind.height, 1);
    std::vector<png_bytep> rows;
    for (int y = 0; y < kind.height; ++y) rows.push_back(&pixels[stride * y]);
    png_write_image(png, rows.data());
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    return file;
}

/// Small files of all kinds, by name.
inline std::vector<std::pair<std::string, std::vector<std::byte>>> sample_photos() {
    std::vector<std::pair<std::string, std::vector<std::byte>>> photos;
    const auto jpeg = [&](const char* name, const JpegKind& kind) {
        photos.emplace_back(std::string(name) + ".jpg", jpeg_file(kind));
    };
    jpeg("colour", {});
    jpeg("full_colour", {.sampling = 1});
    jpeg("grey", {.channels = 1, .sampling = 1});
    jpeg("inks", {.channels = 4, .sampling = 1});
    jpeg("rgb", {.sampling = 1, .as_rgb = true});
    jpeg("progressive", {.width = 40, .height = 24, .progressive = true});
    jpeg("progressive_grey", {.channels = 1, .progressive = true, .sampling = 1});
    jpeg("restarts", {.width = 40, .height = 24, .restart = 1});
    jpeg("progressive_restarts", {.progressive = true, .restart = 1});
    for (const bool interlaced : {false, true})
        for (const bool transparent : {false, true})
            for (const int type : {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_RGB, PNG_COLOR_TYPE_PALETTE,
                                   PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB_ALPHA})
                for (const int depth : {1, 2, 4, 8, 16}) {
                    if (transparent && (type & PNG_COLOR_MASK_ALPHA) != 0) continue;
                    if (depth < 8 && type != PNG_COLOR_TYPE_GRAY && type != PNG_COLOR_TYPE_PALETTE)
                        continue;
                    if (depth == 16 && type == PNG_COLOR_TYPE_PALETTE) continue;
                    photos.emplace_back("png_" + std::to_string(type) + "_" +
                                            std::to_string(depth) +
                                            (transparent ? "_transparent" : "") +
                                            (interlaced ? "_interlaced" : "") + ".png",
                                        png_file({.type = type,
                                                  .depth = depth,
                                                  .transparent = transparent,
                                                  .interlaced = interlaced}));
                }
    return photos;
}

}  // namespace darb::test
