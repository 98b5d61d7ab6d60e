// A window that is moved and let rest, for what `darb view --times` measures.
#pragma once

#include <atomic>
#include <chrono>
#include <vector>

#include "viewer/seconds.h"
#include "viewer/window.h"

namespace darb {

using ViewClock = std::chrono::steady_clock;

/// The window that is measured, and whether its display is gone.
struct MeasuredView {
    ViewerWindow& window;
    const std::atomic<bool>& lost;
};

/// A frame where one is wanted. Throws Error where the window was closed, its display is gone or
/// the viewer has one.
void pump(const MeasuredView& m, double patience_s);

struct Rest {
    double refined_s = 0, whole_s = 0;  // until all pixels; until all splats, too
};
/// Until the picture is whole.
Rest rest(const MeasuredView& m);

/// The orbit's step of so many seconds.
void turn(ViewerWindow& window, double seconds);
/// Orbits for so many seconds; adds each frame's time, ms.
void move(const MeasuredView& m, double seconds, std::vector<double>& moving_ms);

/// PSNR of frames in motion, as the window shows them, against the picture at rest from the same
/// place; panels hidden; six places around the scene.
std::vector<double> compare_motion(const MeasuredView& m);

}  // namespace darb
