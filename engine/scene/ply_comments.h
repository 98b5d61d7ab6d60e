// The header comments of splat PLY files, plain and compressed: SplatKernel, SplatFootprint and
// SplatRenderMode (default or mip; Postshot has "antialiased 0" or 1). The last of a kind counts;
// keys and render modes are read in any case. A kernel of one's own has SplatKernelFunction too,
// the "function" of engine/kernels/kernel_file.h, and for other programs SplatKernelPolynomial.
#pragma once

#include <string>
#include <vector>

#include "engine/scene/ply_table.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// Throws Error for a kernel or footprint that is not known; registers a kernel that is defined.
/// notes: what comments ask for that is not done.
void read_ply_comments(const PlyHeader& header, const std::string& where, SplatModel& model,
                       std::vector<std::string>& notes);
/// What nerfstudio's "Vertical Axis: z" says is up: "z"; "" without such a comment.
std::string stated_up(const PlyHeader& header);
/// Whole header lines.
std::string ply_comments(const SplatModel& model);

}  // namespace darb
