// SPDX-License-Identifier: MIT
#include "engine/core/user_folders.h"

#include <optional>
#include <string>

#include "engine/core/system.h"

namespace darb {

namespace {

std::filesystem::path absolute_folder(const char* variable) {
    const std::filesystem::path named = environment(variable).value_or("");
    return named.is_absolute() ? named : std::filesystem::path();
}

// in_home: where Unix has it; in_local: beside what other programs keep on Windows.
std::filesystem::path user_folder(const char* variable, const char* in_home, const char* in_local) {
    if (const auto named = absolute_folder(variable); !named.empty()) return named / "darb";
    if (const auto local = absolute_folder("LOCALAPPDATA"); !local.empty())
        return local / "darb" / in_local;
    if (const auto home = absolute_folder("HOME"); !home.empty()) return home / in_home / "darb";
    return {};
}

}  // namespace

std::filesystem::path cache_folder() {
    return user_folder("XDG_CACHE_HOME", ".cache", "cache");
}

std::filesystem::path state_folder() {
    return user_folder("XDG_STATE_HOME", ".local/state", "state");
}

}  // namespace darb
