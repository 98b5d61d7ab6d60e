// Which property of a splat PLY is what: the names of 3DGS, and what other programs write in place
// of one:
//   f_rest_* up to 71                harmonics of degree 4, whose last band is left out
//   red green blue, uchar            colours in place of f_dc (nerfstudio)
//   no scale_2                       splats without thickness (2DGS)
//   filter_3D                        a blur that is not yet in scales and opacities (Mip-Splatting)
#pragma once

#include <array>
#include <string>
#include <vector>

#include "engine/scene/ply_table.h"
#include "engine/scene/splat_attributes.h"

namespace darb {

/// Columns of a row as translate_row leaves it.
struct PlyColumns {
    std::size_t count = 0;  // of the file's rows
    /// Of each attribute, in the order of the model's floats; empty where there is none.
    std::array<std::vector<int>, kAttributeCount> of;
    std::vector<int> normal;  // those of nx ny nz that are there
    bool dc_is_byte = false;
    int filter = -1;                  // filter_3D, world; -1: none
    std::vector<std::string> notes;   // on what is not as in 3DGS, a sentence each
    std::vector<std::string> unread;  // names of what has no meaning here
};

/// Throws Error where a property is missing.
PlyColumns find_ply_columns(const PlyElement& vertex, const std::string& where);

/// columns.notes and, in one more, what was left out; has_normals: some are not 0.
std::vector<std::string> ply_notes(const PlyColumns& columns, bool has_normals);

/// The values of a row of the file in the terms of 3DGS, kept in `row` where they are others.
const double* translate_row(const PlyColumns& columns, const double* values,
                            std::vector<double>& row);

}  // namespace darb
