// Every splat file there is a reader for, told apart by content, and the files that can be written.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/scene/ply_table.h"
#include "engine/scene/splat_model.h"

namespace darb {

enum class SplatFormat { ply, compressed_ply, dot_splat, spz, sog };

/// "PLY", "compressed PLY", ".splat", "SPZ", "SOG".
std::string_view format_name(SplatFormat format);

/// What a file says besides its splats.
struct SplatFile {
    SplatFormat format = SplatFormat::ply;
    int version = 0;                 // SPZ and SOG; 0 for formats without
    std::string details;             // encoding, generator; may be empty
    std::uint64_t bytes = 0;         // on disk, all files of a folder
    std::size_t dropped = 0;         // splats with NaN or infinity
    std::vector<std::string> notes;  // what was left out or set right, a sentence each
};

/// path: a file of any of the formats, a folder with the meta.json of a SOG scene, or that
/// meta.json. The content decides; the name counts for .splat alone, which has nothing to know it
/// by. Throws Error naming file, place, reason and remedy; of a point cloud it says that it is one.
SplatModel load_splats(const std::filesystem::path& path, SplatFile* file = nullptr);
/// The same from memory, but for folders. A name that ends in .splat is believed. progress: as
/// read_ply_rows takes it; of PLY and compressed PLY alone, the others are small or quick.
SplatModel parse_splats(std::span<const std::byte> bytes, const std::string& where,
                        SplatFile* file = nullptr, const ReadProgress& progress = {});

/// A folder with meta.json.
bool is_sog_folder(const std::filesystem::path& path);
/// PLY whose vertices have positions and no opacity: opens as points (engine/data/point_splats.h).
bool is_point_cloud(std::span<const std::byte> bytes, const std::string& where = "PLY");
bool is_point_cloud(const PlyHeader& header);

/// What a name asks for when writing: .compressed.ply, .ply, .splat, .spz; nothing for others.
std::optional<SplatFormat> format_to_write(const std::filesystem::path& path);
/// What of this scene the format has no place for, and what of it other programs may not read, a
/// sentence each. Throws as encode_splats does.
std::vector<std::string> losses_of(SplatFormat format, const SplatModel& model,
                                   const std::string& where = "scene");
/// Drops what is left out: splats with NaN or infinity and, of all formats but PLY, those without a
/// rotation, which are not drawn, and would be where a file holds no other length than 1.
std::size_t drop_unwritable(SplatFormat format, SplatModel& model);
/// All but sog, after drop_unwritable. `where` stands for the file name in errors.
std::vector<std::byte> encode_splats(SplatFormat format, const SplatModel& model,
                                     const std::string& where = "scene");
/// Through write_file_atomic.
void save_splats(const std::filesystem::path& path, SplatFormat format, const SplatModel& model);

}  // namespace darb
