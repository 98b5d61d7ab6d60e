// The contract of SplatModel's arrays.
#pragma once

#include <string>
#include <vector>

#include "engine/scene/splat_model.h"

namespace darb {

/// Throws Error where the degree or the length of an array is wrong, or splats of a kernel with
/// shapes have none.
void check_splat_shapes(const SplatModel& model);

/// Whether splats of this kernel hold an attribute: an optional one is the kernel's own.
bool kernel_takes(int kernel, int attribute);
/// Sets the kernel. Splats that had no shape get 0, the start, where it takes one; they lose theirs
/// where it takes none.
void set_kernel(SplatModel& model, int kernel);
/// The same for what was read: a note where its kernel takes shapes and the file has none.
void settle_shapes(SplatModel& model, std::vector<std::string>& notes);

}  // namespace darb
