// SPDX-License-Identifier: MIT
// The device of a command: what --device says, and the environment: DARB_VALIDATION=1 turns the
// validation layers on, DARB_FAULT injects faults for tests (engine/gpu/faults.h), compiled shaders
// are kept in the user's cache folder.
#pragma once

#include <string>

#include "engine/gpu/device.h"

namespace darb {

/// Sets MESA_SHADER_CACHE_DIR where nothing has set it. Throws Error where DARB_FAULT names no
/// fault.
DeviceOptions command_device(const std::string& select);

}  // namespace darb
