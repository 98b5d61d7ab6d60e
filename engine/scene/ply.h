// SPDX-License-Identifier: MIT
// Splat scenes as PLY, the layout of 3DGS that every viewer reads: x y z nx ny nz f_dc_0..2
// f_rest_* (all red, then green, then blue) opacity scale_0..2 rot_0..3, and three header comments:
// SplatKernel, SplatFootprint and SplatRenderMode (default or mip).
#pragma once

#include <array>
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
    std::vector<std::string> notes;  // what was left out or differs from 3DGS, one sentence each
    std::string up;                  // as --up takes it, where a comment names it; else empty
    double position_step = 0;        // compressed PLY: median step over its chunks, world units
};

/// Reads properties by name, in any order and of any type; SH degree 0 to 4 (whose last band is
/// left out); the dialects listed below; compressed PLY (compressed_ply.h); ascii and binary of
/// both byte orders. Other elements are skipped. A splat with a NaN or infinite parameter is
/// dropped, except as splat_model.h says. Without header comments, a scene has the kernel
/// gaussian, the footprint psi and the default render mode. Positions are stored as set_positions
/// does. Throws Error naming file, record and reason.
SplatModel read_ply(const std::filesystem::path& path);
/// Reads a PLY from memory; `where` stands for the file name in errors. progress: see
/// read_ply_rows; header: the result of parse_ply_header, where the caller has it already.
SplatModel parse_ply(std::span<const std::byte> file, const std::string& where,
                     PlyFacts* facts = nullptr, const ReadProgress& progress = {});
SplatModel parse_ply(std::span<const std::byte> file, const PlyHeader& header,
                     const std::string& where, PlyFacts* facts, const ReadProgress& progress);

/// Whether float32 does not resolve the positions (origin_for_float32), as in scenes at map
/// coordinates.
bool needs_double_positions(const SplatModel& model);
/// Writes little-endian float32, with x y z as double where needed. A file that was read without
/// recentring is written back with bit-equal values.
void write_ply(const std::filesystem::path& path, const SplatModel& model);
std::vector<std::byte> encode_ply(const SplatModel& model);

// The header comments of splat PLY files, plain and compressed: SplatKernel, SplatFootprint and
// SplatRenderMode (default or mip; Postshot writes "antialiased 0" or 1), and SplatMetresPerUnit
// where the scale is known. The last comment of a kind counts; keys and render modes are read in
// any case. A user's own kernel also has
// SplatKernelFunction, the "function" of engine/kernels/kernel_definition.h, and
// SplatKernelPolynomial for other programs.

/// Throws Error for an unknown kernel or footprint; registers a kernel that the comments define.
/// notes: receives what comments ask for but is not supported.
void read_ply_comments(const PlyHeader& header, const std::string& where, SplatModel& model,
                       std::vector<std::string>& notes);
/// The axis that nerfstudio's "Vertical Axis: z" names as up: "z"; "" without such a comment.
std::string stated_up(const PlyHeader& header);
/// The comments as whole header lines.
std::string ply_comments(const SplatModel& model);

// The meaning of the properties of a splat PLY: the names of 3DGS, and what other programs write in
// their place:
//   f_rest_* up to 71                harmonics of degree 4, whose last band is left out
//   red green blue, uchar            colours in place of f_dc (nerfstudio)
//   no scale_2                       splats without thickness (2DGS)
//   filter_3D                        a blur that is not yet in scales and opacities (Mip-Splatting)
//   beta, sh0_*, shN_*               exponents 4 exp(beta) of (1 - d^2), harmonics (Deformable Beta
//                                    Splatting)

/// Which column of a row holds what, once translate_row has been applied.
struct PlyColumns {
    std::size_t count = 0;  // number of columns in the file
    /// The columns of each attribute, in the order of the model's floats; empty where the file
    /// lacks it.
    std::array<std::vector<int>, kAttributeCount> of;
    std::vector<int> normal;  // columns of nx, ny and nz, as far as they exist
    bool dc_is_byte = false;
    int filter = -1;                  // filter_3D, world; -1: none
    bool foreign_beta = false;        // `beta` is read as the shape
    std::vector<std::string> notes;   // on differences from 3DGS, one sentence each
    std::vector<std::string> unread;  // names of properties without a meaning here
};

/// Throws Error where a property is missing.
PlyColumns find_ply_columns(const PlyElement& vertex, const std::string& where);

/// columns.notes, and a note on what was left out. has_normals: some normal is not 0.
std::vector<std::string> ply_notes(const PlyColumns& columns, bool has_normals);

/// Converts scales and shapes of Deformable Beta Splatting to those of the kernel beta with its
/// exact footprint. It draws (1 - d^2)^b in the picture, with b = 4 exp(beta) and d = 1 where a
/// splat ends, which is the exact footprint of the exponent b - 1/2. Returns how many exponents
/// were clamped.
std::size_t take_foreign_shapes(SplatModel& model);

/// The values of a row in the terms of 3DGS; stored in `row` where they differ from those in the
/// file.
const double* translate_row(const PlyColumns& columns, const double* values,
                            std::vector<double>& row);

}  // namespace darb
