// The device of a command: what --device says, and the environment: DARB_VALIDATION=1 turns the
// validation layers on, DARB_FAULT injects faults for tests (engine/gpu/faults.h), compiled shaders
// are kept in the user's cache folder.
#pragma once

#include <string>

#include "engine/gpu/device.h"
#include "engine/ranks/ranks.h"

namespace darb {

/// Sets MESA_SHADER_CACHE_DIR where nothing has set it. Throws Error where DARB_FAULT names no
/// fault.
DeviceOptions command_device(const std::string& select);

/// Each rank measures its own device, and of equal ones each might choose another way: the device
/// takes the choice of rank 0's, but for keeps_own. All ranks ask, whatever their options are.
void take_tuning_of_first(Ranks& ranks, Device& device, bool keeps_own);

}  // namespace darb
