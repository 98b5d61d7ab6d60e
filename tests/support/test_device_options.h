// The device of tests: that of the command, so both compile a shader once.
#pragma once

#include "engine/gpu/device_environment.h"

namespace darb::test {

inline DeviceOptions device_options() {
    return command_device("");
}

}  // namespace darb::test
