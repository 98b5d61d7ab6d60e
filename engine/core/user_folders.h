// SPDX-License-Identifier: MIT
// Folders of the user that outlive a command, as the environment names them (XDG Base Directory
// Specification; relative names do not count).
#pragma once

#include <filesystem>

namespace darb {

/// $XDG_CACHE_HOME/darb, else $HOME/.cache/darb, and on Windows %LOCALAPPDATA%\darb\cache; "" where
/// none is set.
std::filesystem::path cache_folder();
/// $XDG_STATE_HOME/darb, else $HOME/.local/state/darb, and on Windows %LOCALAPPDATA%\darb\state; ""
/// where none is set.
std::filesystem::path state_folder();

}  // namespace darb
