// SPDX-License-Identifier: MIT
// Any bytes as the files of a COLMAP model and as the head of a photo. The first byte picks which.
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "engine/core/error.h"
#include "engine/data/colmap.h"
#include "engine/data/image_io.h"
#include "engine/data/lens_model.h"

namespace {

void read(int which, std::span<const std::byte> file) {
    const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
    std::size_t dropped = 0;
    if (which == 0 || which == 3) {
        const darb::ColmapCameras cameras = which == 0
                                                ? darb::parse_colmap_cameras(file, "fuzz")
                                                : darb::parse_colmap_cameras_text(text, "fuzz");
        int left = 4;  // a lens takes milliseconds
        for (const auto& [id, lens] : cameras)
            if (left-- > 0) darb::undistorted_frame(lens, "fuzz");
    }
    if (which == 1) darb::parse_colmap_images(file, "fuzz");
    if (which == 2) darb::parse_colmap_points(file, "fuzz", dropped);
    if (which == 4) darb::parse_colmap_images_text(text, "fuzz");
    if (which == 5) darb::parse_colmap_points_text(text, "fuzz", dropped);
    if (which == 6) darb::exif_orientation(file);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    try {
        read(data[0] % 7, std::as_bytes(std::span(data + 1, size - 1)));
    } catch (const darb::Error&) {
    }
    return 0;
}
