#include "tools/darb/trained_cameras.h"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "engine/core/say.h"
#include "engine/data/camera_list.h"
#include "tools/darb/outputs.h"
#include "trainer/job/scene_file.h"

namespace darb {

namespace fs = std::filesystem;

void take_trained_cameras(const fs::path& scene, std::vector<View>& views) {
    const fs::path log = log_of_run(scene);
    if (log.empty()) return;
    const nlohmann::json start = start_of_run(log);
    const nlohmann::json::json_pointer refined("/settings/effects/cameras");
    if (!start.is_object() || !start.contains(refined) || start[refined] != true) return;
    const fs::path file = log.parent_path() / "cameras.json";
    std::map<std::string, Camera> trained;
    for (const View& view : load_cameras(file)) trained[view.name] = view.camera;
    std::size_t taken = 0;
    for (View& view : views) {
        const auto at = trained.find(view.name);
        if (at == trained.end()) continue;
        const Camera& from = at->second;
        Camera& to = view.camera;
        const double x = double(to.width) / from.width, y = double(to.height) / from.height;
        to.rotation = from.rotation;
        to.translation = from.translation;
        to.fx = from.fx * x, to.cx = from.cx * x;
        to.fy = from.fy * y, to.cy = from.cy * y;
        ++taken;
    }
    say_note(fmt::format("cameras: {} of {} as {} has them, refined", taken, views.size(),
                         file.string()));
}

}  // namespace darb
