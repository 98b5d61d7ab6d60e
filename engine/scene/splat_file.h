// Every splat file there is a reader for, told apart by content, and the files that can be written.
// What is known of each format is its row: splat_format.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/scene/cluster_rows.h"
#include "engine/scene/ply_table.h"
#include "engine/scene/splat_model.h"
#include "engine/scene/stored_units.h"

// The table of splat formats, and the only switch between them. A row is a name: the file that
// reads or writes the format defines `const SplatFormatRow& <name>_format()`, all that is known of
// it (splat_format.h). The order is that in which content is recognised: .splat, which has nothing
// to know it by, comes last.
#define DARB_SPLAT_FORMATS(ROW) \
    ROW(ply)                    \
    ROW(compressed_ply)         \
    ROW(spz)                    \
    ROW(gltf)                   \
    ROW(streamed_sog)           \
    ROW(sog)                    \
    ROW(ksplat)                 \
    ROW(dot_splat)

namespace darb {

enum class SplatFormat {
#define DARB_SPLAT_FORMAT(name) name,
    DARB_SPLAT_FORMATS(DARB_SPLAT_FORMAT)
#undef DARB_SPLAT_FORMAT
};

/// As sentences have it: "PLY", "compressed PLY", ".splat".
std::string_view format_name(SplatFormat format);

/// What a file says besides its splats.
struct SplatFile {
    SplatFormat format = SplatFormat::ply;
    int version = 0;                 // 0 for formats without
    std::string details;             // encoding, generator; may be empty
    std::uint64_t bytes = 0;         // on disk, all files of a folder
    std::size_t dropped = 0;         // splats with NaN or infinity
    std::string up;                  // as --up takes it, where the file says it; else empty
    double position_step = 0;        // world units between two positions; 0: those of float32
    std::vector<std::string> notes;  // what was left out or set right, a sentence each
};

/// path: a file of any of the formats, a folder that is a scene (scene_file_in), or the file it is
/// known by. The content decides; the name counts for .splat, which has nothing to know it by, and
/// for files of a folder. Throws Error naming file, place, reason and remedy; of a point cloud it
/// says that it is one. units: what the user says of how its values are stored. The notes say where
/// they look as if they were stored otherwise than in a scene of 3DGS (stored_units.h).
SplatModel load_splats(const std::filesystem::path& path, SplatFile* file = nullptr,
                       const StoredUnits& units = {});
/// The same from memory. A name that ends in .splat is believed. folder: where files are that this
/// one names; empty: such a file is refused. progress: as read_ply_rows takes it; of PLY and
/// compressed PLY alone, the others are small or quick. read_points: what becomes of a point cloud,
/// a PLY whose vertices have positions and no opacity; null: it is refused.
using ReadPoints = std::function<SplatModel(const PlyHeader&)>;
SplatModel parse_splats(std::span<const std::byte> bytes, const std::string& where,
                        SplatFile* file = nullptr, const ReadProgress& progress = {},
                        const std::filesystem::path& folder = {},
                        const ReadPoints& read_points = {}, const StoredUnits& units = {});

/// The file that makes a folder a scene, as the meta.json of SOG; nothing where there is none.
std::optional<std::filesystem::path> scene_file_in(const std::filesystem::path& folder);
/// Whether a file of this name is the scene_file_in of its folder.
bool names_scene_folder(const std::filesystem::path& path);
/// Whether its vertices have positions and no opacity.
bool is_point_cloud(const PlyHeader& header);

/// What a name ends in that asks for the format, or the whole name where there is no dot at its
/// beginning.
const std::vector<std::string>& endings_of(SplatFormat format);
/// What a name asks for when writing; nothing where it asks for nothing that is written.
std::optional<SplatFormat> format_to_write(const std::filesystem::path& path);
/// The name without the ending that asks for a format; the whole name where none does.
std::string stem_to_write(const std::filesystem::path& path);
/// Whether it is named as a scene of any format is, those that are only read among them.
bool names_scene(const std::filesystem::path& path);
/// All endings that are written, for sentences: ".ply, .spz or .splat".
std::string endings_to_write();
/// What of this scene the format has no place for, and what of it other programs may not read, a
/// sentence each. Throws as encode_scene does.
std::vector<std::string> losses_of(SplatFormat format, const SplatModel& model,
                                   const std::string& where = "scene");
/// Drops what is left out: splats with NaN or infinity and, of all formats but PLY, those without a
/// rotation, which are not drawn, and would be where a file holds no other length than 1.
std::size_t drop_unwritable(SplatFormat format, SplatModel& model);

/// What a scene is written as: one file, and for some formats others in its folder.
struct EncodedSplats {
    std::vector<std::byte> file;
    std::vector<std::pair<std::string, std::vector<std::byte>>> beside = {};  // name, bytes
    std::size_t bytes() const;                                                // of all
};
/// Choices of the formats that have some.
struct EncodeOptions {
    int spz_version = 4;              // 3 or 4
    int precision = -1;               // of precisions_of, 0 is the coarsest; -1: the finest
    AssignRows assign_rows;           // SOG's palette of harmonics; null: on the host
    std::vector<SplatModel> coarser;  // streamed SOG: levels after the scene itself; empty: merged
    ClusterProgress progress;         // of what takes long, SOG's palettes; may be empty
};
/// How many precisions the writer of a format can choose from for this scene; 1: there is no
/// choice.
int precisions_of(SplatFormat format, const SplatModel& model);
/// After drop_unwritable. `where` stands for the file name in errors. Throws Error where the format
/// is not written.
EncodedSplats encode_scene(SplatFormat format, const SplatModel& model,
                           const std::string& where = "scene", const EncodeOptions& options = {});
/// The same for what is one file.
std::vector<std::byte> encode_splats(SplatFormat format, const SplatModel& model,
                                     const std::string& where = "scene");
/// Each through write_file_atomic, the one at `path` last.
void write_encoded(const std::filesystem::path& path, const EncodedSplats& encoded);
void save_splats(const std::filesystem::path& path, SplatFormat format, const SplatModel& model);

// What people call a scene.

/// The output folder of the run that a file OUT/point_cloud/iteration_N/point_cloud.ply is of, by
/// its name alone, absolute; empty for any other file.
std::filesystem::path run_of_scene(const std::filesystem::path& file);

/// The name of the run that it is of; else that of its folder, where it is one, or of its file,
/// with or without the ending. "Scene" where there is no name.
std::string scene_name(const std::filesystem::path& path, bool with_ending = false);

}  // namespace darb
