// How ranks tune their devices.
#pragma once

#include "engine/gpu/device.h"
#include "engine/ranks/ranks.h"

namespace darb {

/// Each rank measures its own device, and of equal ones each might choose another way: the device
/// takes the choice of rank 0's, but for keeps_own. All ranks ask, whatever their options are.
void take_tuning_of_first(Ranks& ranks, Device& device, bool keeps_own);

}  // namespace darb
