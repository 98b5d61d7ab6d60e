#include "tools/darb/compare_scenes.h"

#include <algorithm>

#include "engine/data/metrics.h"
#include "engine/render/renderer.h"
#include "tools/darb/device_options.h"

namespace darb {

namespace {

constexpr double kEqualDb = 100;

}  // namespace

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
