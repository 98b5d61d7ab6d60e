// The EXIF tags that matter here: how a stored photo is to be turned, its focal
// length, and when it was taken.
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace darb {

/// EXIF orientation of a JPEG, 1 to 8 (TIFF 6.0, tag 0x0112); 1 where there is none or it is
/// damaged. Never reads outside `file`, which may be only the first part of the file.
int exif_orientation(std::span<const std::byte> file);

/// Focal length in mm of the lens that sees as much on 35 mm film (Exif 2.3, tag 0xA405); 0 where
/// it is not there. Reads as exif_orientation does.
int exif_focal_35mm(std::span<const std::byte> file);

/// When a JPEG was taken, "2024:05:31 18:02:11" (Exif 3.0, tag 0x9003); empty where that is not
/// said or damaged. Never reads outside `file` either.
std::string exif_time(std::span<const std::byte> file);

}  // namespace darb
