// What the environment asks of a device: DARB_VALIDATION=1 turns the validation layers on,
// DARB_FAULT injects faults (engine/gpu/faults.h).
#pragma once

#include <cstdlib>
#include <string_view>

#include "engine/gpu/device.h"

namespace darb::test {

inline DeviceOptions device_options() {
    DeviceOptions options;
    const char* validation = std::getenv("DARB_VALIDATION");
    options.validation =
        validation != nullptr && *validation != '\0' && std::string_view(validation) != "0";
    if (const char* faults = std::getenv("DARB_FAULT")) options.faults = parse_faults(faults);
    return options;
}

}  // namespace darb::test
