#include "tools/darb/view_times.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <glm/gtc/constants.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/say.h"

namespace darb {

namespace {

using Clock = std::chrono::steady_clock;

constexpr double kMotion_s = 5, kTurn_s = 20;  // of the orbit; of a whole turn
constexpr int kRests = 5;

double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

double quantile(std::vector<double> values, double share) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return values[static_cast<size_t>(share * double(values.size() - 1) + 0.5)];
}

/// The window that is measured, and whether its display is gone.
struct Measured {
    ViewerWindow& window;
    const std::atomic<bool>& lost;
};

void pump(const Measured& m, double patience_s) {
    ViewerWindow& window = m.window;
    if (m.lost) throw Error("window", "the display is gone", "Try again.");
    if (!window.pump(patience_s)) throw Error("--times", "the window was closed", "Try again.");
    const std::string& error = window.viewer().session().error;
    if (!error.empty()) throw Error("darb view", error);
}

struct Rest {
    double refined_s = 0, whole_s = 0;  // until all pixels; until all splats, too
};

// Until the picture is whole.
Rest rest(const Measured& m) {
    const auto start = Clock::now();
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
    window.viewer().session().navigation.orbit(2 * glm::pi<double>() * seconds / kTurn_s, 0);
    window.redraw();
}

/// "VmHWM", the most memory that the process has had, bytes; 0 where the system does not say.
double peak_memory_bytes() {
    if (!std::filesystem::exists("/proc/self/status")) return 0;
    const std::string text = read_text_file("/proc/self/status");
    const size_t at = text.find("VmHWM:");
    return at == std::string::npos ? 0 : 1024 * std::stod(text.substr(at + 6));
}

}  // namespace

void write_view_times(ViewerWindow& window, const Device& device, const std::atomic<bool>& lost,
                      const std::filesystem::path& file) {
    const Measured measured{window, lost};
    const auto start = Clock::now();
    const Session& s = window.viewer().session();
    rest(measured);
    const double to_first_rest_s = seconds_since(start);
    std::vector<double> moving_ms;
    const auto motion = Clock::now();
    for (auto last = motion; seconds_since(motion) < kMotion_s;) {
        turn(window, seconds_since(last));
        last = Clock::now();
        pump(measured, 0);
        moving_ms.push_back(s.times.frame_ms);
    }
    const double frames_per_s = double(moving_ms.size()) / seconds_since(motion);
    const MotionQuality quality = s.times.quality;
    std::vector<double> refined_s, whole_s, rest_ms;
    for (int i = 0; i < kRests; ++i) {
        if (i > 0) turn(window, 0.05);
        const Rest times = rest(measured);
        refined_s.push_back(times.refined_s);
        whole_s.push_back(times.whole_s);
        rest_ms.push_back(s.times.full_ms);
    }
    const Canvas& canvas = window.viewer().canvas();
    const nlohmann::ordered_json json = {{"scene", s.scene->file.filename().string()},
                                         {"splats", s.scene->model.size()},
                                         {"sh_degree", s.scene->model.sh_degree},
                                         {"device", device.info().name},
                                         {"driver", device.info().driver},
                                         {"width_px", canvas.width()},
                                         {"height_px", canvas.height()},
                                         {"load_s", s.scene->load_s},
                                         {"load_to_first_rest_s", to_first_rest_s},
                                         {"motion",
                                          {{"frames", moving_ms.size()},
                                           {"frames_per_s", frames_per_s},
                                           {"first_ms", moving_ms.front()},
                                           {"median_ms", quantile(moving_ms, 0.5)},
                                           {"p95_ms", quantile(moving_ms, 0.95)},
                                           {"scale", quality.scale},
                                           {"splat_share", quality.splats}}},
                                         {"rest",
                                          {{"median_ms", quantile(rest_ms, 0.5)},
                                           {"worst_ms", quantile(rest_ms, 1)},
                                           {"refined_after_s", quantile(refined_s, 0.5)},
                                           {"refined_after_worst_s", quantile(refined_s, 1)},
                                           {"whole_after_s", quantile(whole_s, 0.5)},
                                           {"whole_after_worst_s", quantile(whole_s, 1)}}},
                                         {"peak_memory_bytes", peak_memory_bytes()},
                                         {"device_memory_bytes", device.allocated_bytes()}};
    write_file_atomic(file,
                      json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
    tell("{}: {:.1f} frames/s in motion ({:.1f} ms, first {:.1f} ms), at rest {:.1f} ms\n",
         s.scene->file.filename().string(), frames_per_s, quantile(moving_ms, 0.5),
         moving_ms.front(), quantile(rest_ms, 0.5));
}

}  // namespace darb
