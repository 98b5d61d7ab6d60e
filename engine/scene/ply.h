// Splat scenes as PLY, the layout of 3DGS that every viewer reads: x y z nx ny nz f_dc_0..2
// f_rest_* (all red, then green, then blue) opacity scale_0..2 rot_0..3, and three header comments:
// SplatKernel, SplatFootprint and SplatRenderMode (default or mip).
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "engine/scene/ply_table.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// What a file says besides its splats.
struct PlyFacts {
    std::size_t dropped = 0;         // splats with NaN or infinity
    std::vector<std::string> notes;  // what was left out or is not as in 3DGS, a sentence each
    std::string up;                  // as --up takes it, where a comment names it; else empty
    double position_step = 0;        // compressed PLY: of half of its chunks, world
};

/// Reads by property name: any order, any type, SH degree 0 to 4 (of which the last band is left
/// out), the dialects of ply_dialects.h, other elements skipped; compressed PLY too
/// (compressed_ply.h); ascii and binary of both byte orders. A splat with a NaN or infinite
/// parameter is dropped, but for what infinite_values.h keeps. Without comments: gaussian, psi,
/// default. Positions as set_positions has them. Throws Error naming the file, the record and the
/// reason.
SplatModel read_ply(const std::filesystem::path& path);
/// The same from memory; `where` stands for the file name in errors.
/// progress as read_ply_rows takes it; header: parse_ply_header's, where that was called before.
SplatModel parse_ply(std::span<const std::byte> file, const std::string& where,
                     PlyFacts* facts = nullptr, const ReadProgress& progress = {});
SplatModel parse_ply(std::span<const std::byte> file, const PlyHeader& header,
                     const std::string& where, PlyFacts* facts, const ReadProgress& progress);

/// Whether float32 does not resolve them (origin_for_float32: scenes at map coordinates).
bool needs_double_positions(const SplatModel& model);
/// Little-endian float32, x y z double where needed. A file that was read without recentring is
/// written back bit-equal in its values.
void write_ply(const std::filesystem::path& path, const SplatModel& model);
std::vector<std::byte> encode_ply(const SplatModel& model);

}  // namespace darb
