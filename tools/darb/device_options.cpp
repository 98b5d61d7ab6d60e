#include "tools/darb/device_options.h"

#include <cstdlib>
#include <string_view>

namespace darb {

DeviceOptions command_device(const std::string& select) {
    DeviceOptions options;
    options.select = select;
    const char* validation = std::getenv("DARB_VALIDATION");
    options.validation =
        validation != nullptr && *validation != '\0' && std::string_view(validation) != "0";
    if (const char* faults = std::getenv("DARB_FAULT")) options.faults = parse_faults(faults);
    return options;
}

}  // namespace darb
