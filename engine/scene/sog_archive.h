// Where the parts of a SOG scene come from: the entries of a zip (libzip) or the files of a folder;
// and their pictures (libwebp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace darb {

/// The bytes of a part, by its name in meta.json. Throws Error where there is none.
using SogPart = std::function<std::vector<std::byte>(const std::string& name)>;

/// zip has to outlive what is returned.
SogPart open_sog_zip(std::span<const std::byte> zip, const std::string& where);
/// Names with folders are refused.
SogPart open_sog_folder(const std::filesystem::path& folder);

/// Stored, not compressed again; the same parts give the same bytes.
std::vector<std::byte> make_sog_zip(
    const std::vector<std::pair<std::string, std::vector<std::byte>>>& parts,
    const std::string& where);

struct SogImage {
    std::size_t width = 0, height = 0;  // px
    std::vector<std::uint8_t> rgba;     // [H][W][4]
};

/// Throws Error where the bytes are no WebP, or a picture of more than `most` pixels.
SogImage decode_webp(std::span<const std::byte> bytes, std::size_t most, const std::string& where);

}  // namespace darb
