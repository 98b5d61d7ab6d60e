#include "tools/darb/view_times.h"

#include <fmt/format.h>

#include <atomic>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/core/files.h"
#include "engine/core/quantile.h"
#include "engine/core/say.h"
#include "tools/darb/view_motion.h"

namespace darb {

namespace {

constexpr double kMotion_s = 5;  // of the orbit
constexpr int kRests = 5;

/// "VmHWM", the most memory that the process has had, bytes; 0 where the system does not say.
double peak_memory_bytes() {
    if (!std::filesystem::exists("/proc/self/status")) return 0;
    const std::string text = read_text_file("/proc/self/status");
    const size_t at = text.find("VmHWM:");
    return at == std::string::npos ? 0 : 1024 * std::stod(text.substr(at + 6));
}

// Several rests after small turns.
nlohmann::ordered_json rests_json(ViewerWindow& window, const MeasuredView& measured) {
    std::vector<double> refined_s, whole_s, rest_ms;
    for (int i = 0; i < kRests; ++i) {
        if (i > 0) turn(window, 0.05);
        const Rest times = rest(measured);
        refined_s.push_back(times.refined_s);
        whole_s.push_back(times.whole_s);
        rest_ms.push_back(window.viewer().session().times.full_ms);
    }
    return {{"median_ms", nearest_rank(rest_ms, 0.5)},
            {"worst_ms", nearest_rank(rest_ms, 1)},
            {"refined_after_s", nearest_rank(refined_s, 0.5)},
            {"refined_after_worst_s", nearest_rank(refined_s, 1)},
            {"whole_after_s", nearest_rank(whole_s, 0.5)},
            {"whole_after_worst_s", nearest_rank(whole_s, 1)}};
}

}  // namespace

void write_view_times(ViewerWindow& window, const Device& device, const std::atomic<bool>& lost,
                      const std::filesystem::path& file) {
    const MeasuredView measured{window, lost};
    const auto start = ViewClock::now();
    const Session& s = window.viewer().session();
    rest(measured);
    const double to_first_rest_s = seconds_since(start);
    while (!window.viewer().levels_ready()) pump(measured, 0.1);
    const double levels_s = seconds_since(start);
    std::vector<double> moving_ms;
    const auto motion = ViewClock::now();
    move(measured, kMotion_s, moving_ms);
    const double frames_per_s = double(moving_ms.size()) / seconds_since(motion);
    const double first_ms = moving_ms.front();  // before they are reordered
    const MotionQuality quality = s.times.quality;
    const nlohmann::ordered_json rests = rests_json(window, measured);
    std::vector<double> psnr_db = compare_motion(measured);
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
                                         {"load_to_levels_s", levels_s},
                                         {"motion",
                                          {{"frames", moving_ms.size()},
                                           {"frames_per_s", frames_per_s},
                                           {"first_ms", first_ms},
                                           {"median_ms", nearest_rank(moving_ms, 0.5)},
                                           {"p95_ms", nearest_rank(moving_ms, 0.95)},
                                           {"scale", quality.scale},
                                           {"splat_share", quality.splats},
                                           {"psnr_db", nearest_rank(psnr_db, 0.5)},
                                           {"worst_psnr_db", nearest_rank(psnr_db, 0)}}},
                                         {"rest", rests},
                                         {"peak_memory_bytes", peak_memory_bytes()},
                                         {"device_memory_bytes", device.allocated_bytes()}};
    write_file_atomic(file,
                      json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
    tell(
        "{}: {:.1f} frames/s in motion ({:.1f} ms, first {:.1f} ms, {:.1f} dB), at rest {:.1f} "
        "ms\n",
        s.scene->file.filename().string(), frames_per_s, nearest_rank(moving_ms, 0.5), first_ms,
        nearest_rank(psnr_db, 0.5), rests["median_ms"].get<double>());
}

}  // namespace darb
