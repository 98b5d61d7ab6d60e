// SPDX-License-Identifier: MIT
#include "tools/lab/make_scene/write_scene.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/data/colmap.h"
#include "engine/data/depth_io.h"
#include "engine/data/image_io.h"
#include "engine/data/panorama_files.h"

namespace darb::make_scene {

namespace {

// Camera to world with y up and looking down -z, as rows.
nlohmann::json pose_json(const Camera& camera) {
    const glm::dmat3 to_world = glm::transpose(camera.rotation);
    const glm::dvec3 centre = camera.centre();
    nlohmann::json rows = nlohmann::json::array();
    for (int r = 0; r < 3; ++r)
        rows.push_back({to_world[0][r], -to_world[1][r], -to_world[2][r], centre[r]});
    rows.push_back({0.0, 0.0, 0.0, 1.0});
    return rows;
}

std::string transforms_json(const std::vector<View>& views, bool test) {
    const Camera& camera = views.front().camera;
    const bool panoramas = views.front().lens.panorama();
    nlohmann::ordered_json file = {{"w", camera.width},
                                   {"h", camera.height},
                                   {"fl_x", camera.fx},
                                   {"fl_y", camera.fy},
                                   {"cx", camera.cx},
                                   {"cy", camera.cy},
                                   {"frames", nlohmann::ordered_json::array()}};
    if (panoramas)
        file = {{"camera_model", views.front().lens.model},
                {"w", camera.width},
                {"h", camera.height},
                {"frames", nlohmann::ordered_json::array()}};
    for (const View& view : views) {
        if (view.is_test != test) continue;
        file["frames"].push_back(
            {{"file_path", "images/" + view.name}, {"transform_matrix", pose_json(view.camera)}});
    }
    return file.dump(1) + "\n";
}

// Leaves a folder alone that holds photos which this program did not make.
void refuse_other_photos(const std::filesystem::path& images, const std::vector<View>& views) {
    std::error_code none;  // there is no such folder
    for (const auto& entry : std::filesystem::directory_iterator(images, none))
        if (std::none_of(views.begin(), views.end(), [&](const View& view) {
                return view.name == entry.path().filename().string();
            }))
            throw Error(entry.path().string(), "is not one of the photos that are made here",
                        "Name an empty folder.");
}

}  // namespace

void write_scene(const std::filesystem::path& folder, const std::vector<View>& views,
                 const Capture& capture) {
    refuse_other_photos(folder / "images", views);
    std::string held_out;
    for (std::size_t i = 0; i < views.size(); ++i) {
        write_png(folder / "images" / views[i].name, capture.photos[i]);
        if (views[i].is_test) held_out += views[i].name + "\n";
    }
    write_colmap_binary(folder / "sparse" / "0", views, capture.points);
    write_file_atomic(folder / "test.txt", held_out);
    write_file_atomic(folder / "transforms_train.json", transforms_json(views, false));
    write_file_atomic(folder / "transforms_test.json", transforms_json(views, true));
}

void write_panoramas(const std::filesystem::path& folder, const std::vector<View>& views,
                     const std::vector<ImageU8>& photos) {
    refuse_other_photos(folder / "images", views);
    for (std::size_t i = 0; i < views.size(); ++i)
        write_panorama_png(folder / "images" / views[i].name, photos[i]);
    write_file_atomic(folder / "truth.json", transforms_json(views, false));
}

void write_depths(const std::filesystem::path& folder, const std::vector<View>& views,
                  const std::vector<ImageF>& depths) {
    for (std::size_t i = 0; i < views.size(); ++i)
        write_depth_png(folder / "depths" / views[i].name, depths[i], kMillimetre);
}

void write_test_views(const std::filesystem::path& folder, const std::vector<View>& views,
                      const std::vector<ImageU8>& photos) {
    refuse_other_photos(folder / "images", views);
    for (std::size_t i = 0; i < views.size(); ++i)
        write_png(folder / "images" / views[i].name, photos[i]);
    write_file_atomic(folder / "transforms_test.json", transforms_json(views, true));
}

}  // namespace darb::make_scene
