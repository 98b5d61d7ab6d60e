// SPDX-License-Identifier: MIT
// Any bytes as transforms.json, cameras.json and camera_path.json.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "engine/core/error.h"
#include "engine/data/camera_list.h"
#include "engine/data/transforms.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    try {
        const darb::TransformsFile file = darb::parse_transforms(text, "fuzz");
        for (const darb::TransformsFrame& frame : file.frames)
            darb::lens_from_transforms(frame.intrinsics, 80, 60, "fuzz");
    } catch (const darb::Error&) {
    }
    try {
        darb::parse_camera_list(darb::format_camera_list(darb::parse_camera_list(text, "fuzz")),
                                "again");
    } catch (const darb::Error&) {
    }
    try {
        darb::parse_nerfstudio_path(text, "fuzz");
    } catch (const darb::Error&) {
    }
    return 0;
}
