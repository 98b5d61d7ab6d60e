#include "tools/darb/compare_scenes.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/core/error.h"
#include "engine/core/text.h"
#include "engine/data/metrics.h"
#include "engine/gpu/device_environment.h"
#include "engine/render/renderer.h"
#include "tools/cost/views.h"

namespace darb {

namespace {

constexpr double kEqualDb = 100;

}  // namespace

std::string difference_text(const SceneDifference& d, std::size_t views) {
    return fmt::format("{:.2f} dB mean over {} views, {:.2f} dB at worst ({})", d.mean_psnr_db,
                       views, d.worst_psnr_db, printable(d.worst_view));
}

std::vector<View> views_around(const SplatModel& scene) {
    if (scene.size() == 0) throw Error("scene", "there are no splats to look at", "Name another.");
    const CostViews around = orbit_views(scene, 8, 480, 360);
    std::vector<View> views(around.cameras.size());
    for (std::size_t i = 0; i < views.size(); ++i) {
        views[i].name = around.names[i];
        views[i].camera = around.cameras[i];
    }
    return views;
}

SceneDifference compare_scenes(const SplatModel& scene, const SplatModel& other,
                               const std::vector<View>& views, const std::string& device) {
    DeviceOptions options = command_device(device);
    Device chosen(options);
    Renderer first(chosen, scene), second(chosen, other);
    SceneDifference difference{0, 1e9, ""};
    for (const View& view : views) {
        const double db =
            std::min(psnr(second.render(view.camera), first.render(view.camera)), kEqualDb);
        difference.mean_psnr_db += db / static_cast<double>(views.size());
        if (db >= difference.worst_psnr_db) continue;
        difference.worst_psnr_db = db;
        difference.worst_view = view.name;
    }
    return difference;
}

}  // namespace darb
