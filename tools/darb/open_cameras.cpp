// SPDX-License-Identifier: MIT
#include "tools/darb/open_cameras.h"

#include <fmt/format.h>

#include "engine/core/say.h"
#include "engine/data/camera_list.h"
#include "engine/scene/project_file.h"

namespace darb {

std::vector<View> open_cameras(const std::filesystem::path& path, const DatasetOptions& options) {
    std::vector<std::string> notes;
    std::vector<View> views = load_cameras(path, options, &notes);
    say_notes(notes);
    return views;
}

std::vector<View> cameras_beside(const std::filesystem::path& scene) {
    if (is_project_file(scene)) {
        const std::filesystem::path cameras = read_project(scene).cameras;
        return cameras.empty() ? std::vector<View>() : load_cameras(cameras);
    }
    for (std::filesystem::path folder = std::filesystem::absolute(scene);
         folder.has_relative_path(); folder = folder.parent_path()) {
        if (std::filesystem::is_regular_file(folder / "cameras.json"))
            return load_cameras(folder / "cameras.json");
        if (folder.filename() != "point_cloud" &&
            folder.parent_path().filename() != "point_cloud" &&
            !std::filesystem::is_regular_file(folder))
            break;
    }
    return {};
}

}  // namespace darb
