// darb view --times: frame times of a window in motion and at rest, as a user would have them.
#pragma once

#include <atomic>
#include <filesystem>

#include "engine/gpu/device.h"
#include "viewer/window.h"

namespace darb {

/// Waits for the scene that is being loaded, orbits it for five seconds, lets it rest; writes what
/// that took as JSON and prints it in a line. Throws Error where the load fails, or where the
/// window is closed before the end.
void write_view_times(ViewerWindow& window, const Device& device, const std::atomic<bool>& lost,
                      const std::filesystem::path& file);

}  // namespace darb
