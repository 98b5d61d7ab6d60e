#include "tools/darb/view_motion.h"

#include <glm/gtc/constants.hpp>
#include <string>
#include <utility>

#include "engine/core/error.h"
#include "engine/data/metrics.h"
#include "viewer/controls.h"

namespace darb {

namespace {

constexpr double kTurn_s = 20;  // of a whole turn
constexpr int kCompared = 6;    // frames in motion, each a sixth of a turn from the one before

}  // namespace

void pump(const MeasuredView& m, double patience_s) {
    ViewerWindow& window = m.window;
    if (m.lost) throw Error("window", "the display is gone", "Try again.");
    if (!window.pump(patience_s)) throw Error("--times", "the window was closed", "Try again.");
    const std::string& error = window.viewer().session().error;
    if (!error.empty()) throw Error("darb view", error);
}

Rest rest(const MeasuredView& m) {
    const auto start = ViewClock::now();
    Rest times;
    do {
        pump(m, 0.01);
        if (times.refined_s == 0 && m.window.viewer().refined())
            times.refined_s = seconds_since(start);
    } while (!m.window.viewer().at_rest());
    times.whole_s = seconds_since(start);
    return times;
}

void turn(ViewerWindow& window, double seconds) {
    leave_photo(window.viewer().session());  // as a drag does: a photo's camera stands still
    window.viewer().session().navigation.orbit(2 * glm::pi<double>() * seconds / kTurn_s, 0);
    window.redraw();
}

void move(const MeasuredView& m, double seconds, std::vector<double>& moving_ms) {
    const auto start = ViewClock::now();
    for (auto last = start; seconds_since(start) < seconds;) {
        turn(m.window, seconds_since(last));
        last = ViewClock::now();
        pump(m, 0);
        moving_ms.push_back(m.window.viewer().session().times.frame_ms);
    }
}

std::vector<double> compare_motion(const MeasuredView& m) {
    ViewerWindow& window = m.window;
    Session& s = window.viewer().session();
    const bool panels = std::exchange(s.panels, false);
    std::vector<double> psnr_db;
    for (int i = 0; i < kCompared; ++i) {
        turn(m.window, kTurn_s / kCompared);
        rest(m);
        turn(m.window, 0.02);
        pump(m, 0);
        const ImageF moving = to_float(window.viewer().canvas().read_back());
        rest(m);
        psnr_db.push_back(psnr(moving, to_float(window.viewer().canvas().read_back())));
    }
    s.panels = panels;
    window.redraw();
    return psnr_db;
}

}  // namespace darb
