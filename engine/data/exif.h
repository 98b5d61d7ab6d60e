// The one EXIF tag that matters here: how a stored photo is to be turned.
#pragma once

#include <cstddef>
#include <span>

namespace darb {

/// EXIF orientation of a JPEG, 1 to 8 (TIFF 6.0, tag 0x0112); 1 where there is none or it is
/// damaged. Never reads outside `file`, which may be only the first part of the file.
int exif_orientation(std::span<const std::byte> file);

}  // namespace darb
