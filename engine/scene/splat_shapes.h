// The contract of SplatModel's arrays.
#pragma once

#include "engine/scene/splat_model.h"

namespace darb {

/// DARB_CHECK of the degree and of every array's length.
void check_splat_shapes(const SplatModel& model);

}  // namespace darb
