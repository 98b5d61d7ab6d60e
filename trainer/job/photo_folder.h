// SPDX-License-Identifier: MIT
// A folder of photos without cameras, for COLMAP.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace darb {

/// PATH/images_folder or PATH, whichever has PNG or JPEG files in it or further below, where PATH
/// has no cameras; else empty. Names that begin with a dot do not count. Throws Error where there
/// are only pictures of formats that are not read, or cameras further below.
std::filesystem::path photos_without_cameras(const std::filesystem::path& path,
                                             const std::string& images_folder);

/// What tells that photos follow each other in the order of their names.
enum class PhotoOrder { none, times, numbers };

struct PhotoList {
    std::string text;  // one line per photo: tells whether OUT/colmap was made from them
    std::vector<std::string> names;  // paths below the folder, in order
    bool one_size = true;
    PhotoOrder order = PhotoOrder::none;
    std::size_t marked_panoramas = 0;  // photos that say that they are equirectangular
    std::size_t twice_as_wide = 0;     // photos that are exactly twice as wide as high
    std::string left_out;  // pictures in formats that are not read, with a remedy; may be empty
};

/// times: when each was taken, empty where that is not known. names: in the order of their bytes,
/// as COLMAP takes them. Times decide where all are known; else the numbers that names of one
/// pattern end in.
PhotoOrder order_of_photos(const std::vector<std::string>& names,
                           const std::vector<std::string>& times);

/// Throws Error where they are too few for COLMAP, or one cannot be read.
PhotoList list_photos(const std::filesystem::path& folder);

}  // namespace darb
