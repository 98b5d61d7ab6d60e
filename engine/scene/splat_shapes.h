// The contract of SplatModel's arrays.
#pragma once

#include "engine/scene/splat_model.h"

namespace darb {

/// Throws Error where the degree or the length of an array is wrong.
void check_splat_shapes(const SplatModel& model);

}  // namespace darb
