// darb view with a window, until it is closed, its display ends or a signal comes.
#pragma once

#include <string>

#include "tools/darb/view_flags.h"

namespace darb {

/// Returns the exit code: 0, or that of the signal that ended it. Throws Error where there is no
/// display or the window fails. Where it ends by itself, what was not saved is recovered, and said.
int view_in_window(const ViewFlags& flags, const ViewerOptions& options, const PixelSize& size,
                   const std::string& note);

}  // namespace darb
