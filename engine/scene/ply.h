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

// The header comments of splat PLY files, plain and compressed: SplatKernel, SplatFootprint and
// SplatRenderMode (default or mip; Postshot has "antialiased 0" or 1). The last of a kind counts;
// keys and render modes are read in any case. A kernel of one's own has SplatKernelFunction too,
// the "function" of engine/kernels/kernel_file.h, and for other programs SplatKernelPolynomial.

/// Throws Error for a kernel or footprint that is not known; registers a kernel that is defined.
/// notes: what comments ask for that is not done.
void read_ply_comments(const PlyHeader& header, const std::string& where, SplatModel& model,
                       std::vector<std::string>& notes);
/// What nerfstudio's "Vertical Axis: z" says is up: "z"; "" without such a comment.
std::string stated_up(const PlyHeader& header);
/// Whole header lines.
std::string ply_comments(const SplatModel& model);

// Which property of a splat PLY is what: the names of 3DGS, and what other programs write in place
// of one:
//   f_rest_* up to 71                harmonics of degree 4, whose last band is left out
//   red green blue, uchar            colours in place of f_dc (nerfstudio)
//   no scale_2                       splats without thickness (2DGS)
//   filter_3D                        a blur that is not yet in scales and opacities (Mip-Splatting)
//   beta, sh0_*, shN_*               exponents 4 exp(beta) of (1 - d^2), harmonics (Deformable Beta
//                                    Splatting)

/// Columns of a row as translate_row leaves it.
struct PlyColumns {
    std::size_t count = 0;  // of the file's rows
    /// Of each attribute, in the order of the model's floats; empty where there is none.
    std::array<std::vector<int>, kAttributeCount> of;
    std::vector<int> normal;  // those of nx ny nz that are there
    bool dc_is_byte = false;
    int filter = -1;                  // filter_3D, world; -1: none
    bool foreign_beta = false;        // `beta` is what is read as the shape
    std::vector<std::string> notes;   // on what is not as in 3DGS, a sentence each
    std::vector<std::string> unread;  // names of what has no meaning here
};

/// Throws Error where a property is missing.
PlyColumns find_ply_columns(const PlyElement& vertex, const std::string& where);

/// columns.notes and, in one more, what was left out; has_normals: some are not 0.
std::vector<std::string> ply_notes(const PlyColumns& columns, bool has_normals);

/// Scales and shapes of Deformable Beta Splatting in the terms of the kernel beta with its exact
/// footprint. It draws (1 - d^2)^b with b = 4 exp(beta) in the picture, d = 1 where a splat ends,
/// which is the exact footprint of the exponent b - 1/2. Returns how many exponents are held.
std::size_t take_foreign_shapes(SplatModel& model);

/// The values of a row of the file in the terms of 3DGS, kept in `row` where they are others.
const double* translate_row(const PlyColumns& columns, const double* values,
                            std::vector<double>& row);

}  // namespace darb
