// A folder of photos without cameras, for COLMAP.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace darb {

/// PATH/images_folder or PATH, whichever has PNG or JPEG files in it or further below, where PATH
/// has no cameras; else empty. Names that begin with a dot do not count. Throws Error where there
/// are only pictures of formats that are not read, or cameras further below.
std::filesystem::path photos_without_cameras(const std::filesystem::path& path,
                                             const std::string& images_folder);

struct PhotoList {
    std::string text;  // a line a photo: tells whether OUT/colmap was made from the same ones
    std::size_t count = 0;
    bool one_size = true;
    std::string left_out;  // pictures of formats that are not read, and the way round; may be empty
};

/// Throws Error where they are too few for COLMAP, or one cannot be read.
PhotoList list_photos(const std::filesystem::path& folder);

}  // namespace darb
