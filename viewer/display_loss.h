// The end of the X server, or of the connection to it, as something that a program can go on after.
#pragma once

#include <atomic>

namespace darb {

/// From now on *lost is set where libX11 would end the process; false where it has no such way (it
/// has since 1.7), or where windows do not come from it: Wayland closes them by itself. After the
/// loss waiting for events without a limit never returns; what is asked of the display does
/// nothing. *lost outlives the window system. A WindowSystem is there.
bool survive_display_loss(std::atomic<bool>& lost);

}  // namespace darb
