// Which property of a splat PLY is what: the names of 3DGS, and what other programs write in place
// of one:
//   f_rest_* up to 71                harmonics of degree 4, whose last band is left out
//   red green blue, uchar            colours in place of f_dc (nerfstudio)
//   no scale_2                       splats without thickness (2DGS)
//   filter_3D                        a blur that is not yet in scales and opacities (Mip-Splatting)
//   beta, sh0_*, shN_*               exponents 4 exp(beta) of (1 - d^2), harmonics (Deformable Beta
//                                    Splatting)
#pragma once

#include <array>
#include <string>
#include <vector>

#include "engine/scene/ply_table.h"
#include "engine/scene/splat_model.h"

namespace darb {

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
