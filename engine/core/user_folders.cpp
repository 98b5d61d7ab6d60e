// SPDX-License-Identifier: MIT
#include "engine/core/user_folders.h"

#include <cstdlib>

namespace darb {

namespace {

std::filesystem::path user_folder(const char* variable, const char* in_home) {
    const char* named = std::getenv(variable);
    if (named != nullptr && *named == '/') return std::filesystem::path(named) / "darb";
    const char* home = std::getenv("HOME");
    if (home != nullptr && *home == '/') return std::filesystem::path(home) / in_home / "darb";
    return {};
}

}  // namespace

std::filesystem::path cache_folder() {
    return user_folder("XDG_CACHE_HOME", ".cache");
}

std::filesystem::path state_folder() {
    return user_folder("XDG_STATE_HOME", ".local/state");
}

}  // namespace darb
