// SPDX-License-Identifier: MIT
// Options for the device of tests: those of the command, so that both compile a shader only once.
#pragma once

#include "engine/gpu/device.h"

namespace darb::test {

inline DeviceOptions device_options() {
    return command_device("");
}

}  // namespace darb::test
