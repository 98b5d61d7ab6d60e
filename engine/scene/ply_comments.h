// The header comments of splat PLY files, plain and compressed: SplatKernel, SplatFootprint and
// SplatRenderMode (default or mip).
#pragma once

#include <string>

#include "engine/scene/ply_table.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// Throws Error for a kernel or footprint that is not known.
void read_ply_comments(const PlyHeader& header, const std::string& where, SplatModel& model);
/// Whole header lines.
std::string ply_comments(const SplatModel& model);

}  // namespace darb
