// SPDX-License-Identifier: MIT
// The contract of SplatModel's arrays.
#pragma once

#include <string>
#include <vector>

#include "engine/scene/splat_model.h"

namespace darb {

/// Throws Error where the degree or the length of an array is wrong, or the kernel needs shapes and
/// the splats have none.
void check_splat_shapes(const SplatModel& model);

/// Whether splats of this kernel have an attribute: optional ones depend on the kernel.
bool kernel_takes(int kernel, int attribute);
/// Sets the kernel. Where it takes shapes, splats without one get 0, the start value; where it does
/// not, shapes are removed.
void set_kernel(SplatModel& model, int kernel);
/// The same for a scene that was read: adds a note where its kernel takes shapes but the file has
/// none.
void settle_shapes(SplatModel& model, std::vector<std::string>& notes);

}  // namespace darb
