// SPDX-License-Identifier: MIT
#include "engine/gpu/device_environment.h"

#include <cstdlib>
#include <string_view>

#include "engine/core/system.h"
#include "engine/core/user_folders.h"

namespace darb {

namespace {

// The key of Mesa's shader cache leaves out lavapipe's vector width: a cache filled at one width
// gives wrong sums at another (seen on Mesa 22.3), so each width gets its own folder.
void separate_mesa_caches(const std::filesystem::path& root) {
    if (root.empty() || std::getenv("MESA_SHADER_CACHE_DIR") != nullptr) return;
    const char* width = std::getenv("LP_NATIVE_VECTOR_WIDTH");
    const std::filesystem::path folder =
        root / ("mesa-width-" + std::string(width != nullptr ? width : "default"));
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (!error) set_missing_environment("MESA_SHADER_CACHE_DIR", folder.string());
}

}  // namespace

DeviceOptions command_device(const std::string& select) {
    DeviceOptions options;
    options.select = select;
    options.cache_folder = cache_folder();
    separate_mesa_caches(options.cache_folder);
    const char* validation = std::getenv("DARB_VALIDATION");
    options.validation =
        validation != nullptr && *validation != '\0' && std::string_view(validation) != "0";
    if (const char* faults = std::getenv("DARB_FAULT")) options.faults = parse_faults(faults);
    return options;
}

}  // namespace darb
