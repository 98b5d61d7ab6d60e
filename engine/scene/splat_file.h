// SPDX-License-Identifier: MIT
// Every splat file that can be read, recognised by content, and the files that can be written.
// splat_format.h describes the row of facts for each format.
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
// reads or writes the format defines `const SplatFormatRow& <name>_format()`, which holds
// everything known about it (splat_format.h). Content is matched in this order; .splat, which has
// no signature, comes last.
#define DARB_SPLAT_FORMATS(ROW) \
    ROW(ply)                    \
    ROW(compressed_ply)         \
    ROW(spz)                    \
    ROW(lcc)                    \
    ROW(gltf)                   \
    ROW(streamed_sog)           \
    ROW(sog)                    \
    ROW(usda)                   \
    ROW(ksplat)                 \
    ROW(dot_splat)

namespace darb {

enum class SplatFormat {
#define DARB_SPLAT_FORMAT(name) name,
    DARB_SPLAT_FORMATS(DARB_SPLAT_FORMAT)
#undef DARB_SPLAT_FORMAT
};

/// The name as in sentences: "PLY", "compressed PLY", ".splat".
std::string_view format_name(SplatFormat format);

/// What a file says besides its splats.
struct SplatFile {
    SplatFormat format = SplatFormat::ply;
    int version = 0;                 // 0 for formats without versions
    std::string details;             // encoding and generator; may be empty
    std::uint64_t bytes = 0;         // on disk, all files of a folder
    std::size_t dropped = 0;         // splats with NaN or infinity
    std::string up;                  // as --up takes it, where the file states it; else empty
    double position_step = 0;        // world units between positions; 0: as float32 has them
    std::vector<std::string> notes;  // what was left out or corrected, one sentence each
};

/// path: a file in any of the formats, a folder that is a scene, or that folder's scene_file_in.
/// The content decides. The name counts only for .splat, which has no signature, and for the
/// files of a folder. units: what the user says about how values are stored. Notes say where values
/// look as if they were stored in other units than those of 3DGS (stored_units.h). Throws Error
/// naming file, place, reason and remedy; for a point cloud, it says that it is one.
SplatModel load_splats(const std::filesystem::path& path, SplatFile* file = nullptr,
                       const StoredUnits& units = {});
/// Reads a scene from memory. A name that ends in .splat is trusted. folder: where the files are
/// that this one names; empty: a file that names others is refused. progress: see read_ply_rows;
/// called for PLY and compressed PLY only, as the other formats are small or quick to read.
/// read_points: called with a point cloud, a PLY whose vertices have positions but no opacity;
/// null: it is refused.
using ReadPoints = std::function<SplatModel(const PlyHeader&)>;
SplatModel parse_splats(std::span<const std::byte> bytes, const std::string& where,
                        SplatFile* file = nullptr, const ReadProgress& progress = {},
                        const std::filesystem::path& folder = {},
                        const ReadPoints& read_points = {}, const StoredUnits& units = {});

/// The file that makes a folder a scene, such as SOG's meta.json; nothing where there is none.
std::optional<std::filesystem::path> scene_file_in(const std::filesystem::path& folder);
/// Whether the path has the name of a scene_file_in, and so stands for its folder.
bool names_scene_folder(const std::filesystem::path& path);
/// Whether the PLY's vertices have positions but no opacity.
bool is_point_cloud(const PlyHeader& header);

/// File name endings that ask for the format; one without a leading dot is a whole file name.
const std::vector<std::string>& endings_of(SplatFormat format);
/// The format that a name asks for when writing; nothing where it asks for none that can be
/// written.
std::optional<SplatFormat> format_to_write(const std::filesystem::path& path);
/// The name without the ending that asks for a format; the whole name where none does.
std::string stem_to_write(const std::filesystem::path& path);
/// Whether the name is that of a scene in any format, including those that can only be read.
bool names_scene(const std::filesystem::path& path);
/// All endings that can be written, for sentences: ".ply, .spz or .splat".
std::string endings_to_write();
/// What the format cannot store of this scene, and what other programs may not read, one sentence
/// each. Throws as encode_scene does.
std::vector<std::string> losses_of(SplatFormat format, const SplatModel& model,
                                   const std::string& where = "scene");
/// Drops splats that must not be written: those with NaN or infinity and, in all formats but PLY,
/// those without a rotation. These are never drawn, but would be where a format stores unit
/// rotations only.
std::size_t drop_unwritable(SplatFormat format, SplatModel& model);

/// A scene as it is written: one file and, in some formats, others in its folder.
struct EncodedSplats {
    std::vector<std::byte> file;
    std::vector<std::pair<std::string, std::vector<std::byte>>> beside = {};  // name, bytes
    std::size_t bytes() const;  // total size of the files
};
/// Choices that some formats offer.
struct EncodeOptions {
    int spz_version = 4;              // 3 or 4
    int precision = -1;               // below precisions_of, 0 is the coarsest; -1: the finest
    AssignRows assign_rows;           // SOG's palette of harmonics; null: on the host
    std::vector<SplatModel> coarser;  // streamed SOG: levels below the scene itself; empty: made by
                                      // merging
    std::size_t file_splats = 256 << 10;  // streamed SOG: most splats in a file, but for a leaf
    ClusterProgress progress;             // for SOG's palettes, which take long; may be empty
};
/// How many precisions the format's writer offers for this scene; 1: there is no choice.
int precisions_of(SplatFormat format, const SplatModel& model);
/// Call drop_unwritable first. `where` stands for the file name in errors. Throws Error where the
/// format cannot be written.
EncodedSplats encode_scene(SplatFormat format, const SplatModel& model,
                           const std::string& where = "scene", const EncodeOptions& options = {});
/// As encode_scene, for formats that are a single file.
std::vector<std::byte> encode_splats(SplatFormat format, const SplatModel& model,
                                     const std::string& where = "scene");
/// Writes each file with write_file_atomic, the one at `path` last.
void write_encoded(const std::filesystem::path& path, const EncodedSplats& encoded);
void save_splats(const std::filesystem::path& path, SplatFormat format, const SplatModel& model);

// Names of scenes, for users.

/// The output folder, as an absolute path, of the run that wrote
/// OUT/point_cloud/iteration_N/point_cloud.ply, judged by the name alone; empty for any other file.
std::filesystem::path run_of_scene(const std::filesystem::path& file);

/// The name of the scene's run; else of its folder, if it is a folder, or of its file, with or
/// without the ending. "Scene" where there is no name.
std::string scene_name(const std::filesystem::path& path, bool with_ending = false);

}  // namespace darb
