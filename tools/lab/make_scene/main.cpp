// SPDX-License-Identifier: MIT
// make_scene FOLDER [SCALE]: renders the data set that the project ships: a still life seen from 40
// training and 8 held-out cameras, with a COLMAP model, and 16 views off that path. Every run
// writes the same bytes. SCALE 1 to 8 multiplies the photos' sides of 200 x 150 px.
// make_scene depths FOLDER [SCALE]: also writes the true depths of all views beside the photos.
// make_scene outdoors FOLDER [SCALE]: photos from near the ground, under clouds.
// make_scene town FOLDER SIDE SCALE: SIDE x SIDE photos of a town of 16 blocks (town.h).
// make_scene town-depths FOLDER SIDE SCALE: also writes the true depths of its photos.
// make_scene panoramas FOLDER COUNT WIDTH: panoramas of a walk through the town, without cameras,
// and their true poses in truth.json.
// make_scene surface FOLDER: what is true of the still life's surface, without photos: surface.ply,
// points that two training photos see, and shapes.json, its shapes (surface.h).
// make_scene town-surface FOLDER SIDE: the same of the town, by SIDE x SIDE photos.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>

#include "tools/lab/make_scene/capture.h"
#include "tools/lab/make_scene/surface.h"
#include "tools/lab/make_scene/town.h"
#include "tools/lab/make_scene/write_scene.h"

namespace {

void make_town(const std::filesystem::path& folder, int side, double scale, bool depths) {
    using namespace darb::make_scene;
    const World world = town();
    const std::vector<darb::View> views = town_flight(side, scale);
    const CaptureSettings settings = town_capture(views.size());
    write_scene(folder, views, capture_views(world, views, settings));
    if (depths) write_depths(folder, views, take_depths(world, views, settings.reach));
}

void make_panoramas(const std::filesystem::path& folder, int count, int width) {
    using namespace darb::make_scene;
    const std::vector<darb::View> views = town_walk(count, width);
    write_panoramas(folder, views, take_photos(town(), views, 0, 4));
}

void make_still_life(const std::filesystem::path& folder, int scale, bool outdoors, bool depths) {
    using namespace darb::make_scene;
    World world = still_life();
    Heights heights;
    if (outdoors) {
        world.clouds = 1;
        heights = {8, 6};
    }
    const std::vector<darb::View> views = camera_path(scale, heights);
    write_scene(folder, views, capture_views(world, views));
    const std::vector<darb::View> away = off_path_views(scale, heights);
    write_test_views(folder / "off_path", away, take_photos(world, away, views.size()));
    if (!depths) return;
    write_depths(folder, views, take_depths(world, views));
    write_depths(folder / "off_path", away, take_depths(world, away));
}

/// Runs what make_scene is asked for; returns the exit status.
template <class Make>
int make(const Make& scene) {
    try {
        scene();
    } catch (const std::exception& error) {
        std::fprintf(stderr, "error: %s\n", error.what());
        return 2;
    }
    return 0;
}

int usage() {
    std::fprintf(
        stderr,
        "usage: make_scene FOLDER [SCALE]   (1 to 8: photos of 200 x 150 px times this)\n"
        "       make_scene depths FOLDER [SCALE]   (with the true depths of the photos)\n"
        "       make_scene outdoors FOLDER [SCALE]   (from near the ground, under clouds)\n"
        "       make_scene town FOLDER SIDE SCALE   (SIDE x SIDE photos; SCALE from 0.2)\n"
        "       make_scene town-depths FOLDER SIDE SCALE   (with the true depths of the photos)\n"
        "       make_scene panoramas FOLDER COUNT WIDTH   (a walk through the town; 3 or more, 64 "
        "px "
        "or more)\n"
        "       make_scene surface FOLDER   (true surfaces of the still life, no photos)\n"
        "       make_scene town-surface FOLDER SIDE   (those of the town)\n");
    return 2;
}

}  // namespace

int main(int argc, char** argv) {
    using namespace darb::make_scene;
    const auto asks_for = [&](const char* what, int arguments) {
        return argc == arguments && std::strcmp(argv[1], what) == 0;
    };
    const bool photos_of_town = asks_for("town", 5) || asks_for("town-depths", 5);
    const bool of_town = photos_of_town || asks_for("town-surface", 4);
    const int side = of_town ? std::atoi(argv[3]) : 2;
    const double town_scale = photos_of_town ? std::atof(argv[4]) : 1;
    if (of_town && (side < 2 || side > 100 || town_scale < 0.2 || town_scale > 8)) return usage();
    if (photos_of_town)
        return make(
            [&] { make_town(argv[2], side, town_scale, std::strcmp(argv[1], "town") != 0); });
    if (asks_for("panoramas", 5)) {
        const int count = std::atoi(argv[3]), width = std::atoi(argv[4]);
        if (count < 3 || count > 1000 || width < 64 || width > 8192 || width % 2 != 0)
            return usage();
        return make([&] { make_panoramas(argv[2], count, width); });
    }
    if (asks_for("town-surface", 4))
        return make([&] { write_surface(argv[2], town(), town_flight(side, 1), kTownSurface); });
    if (asks_for("surface", 3))
        return make(
            [&] { write_surface(argv[2], still_life(), camera_path(), kStillLifeSurface); });
    const bool outdoors = argc >= 3 && std::strcmp(argv[1], "outdoors") == 0;
    const bool depths = argc >= 3 && std::strcmp(argv[1], "depths") == 0;
    if (outdoors || depths) {
        --argc;
        ++argv;
    }
    const int scale = argc == 3 ? std::atoi(argv[2]) : 1;
    if (argc < 2 || argc > 3 || argv[1][0] == '-' || scale < 1 || scale > 8) return usage();
    return make([&] { make_still_life(argv[1], scale, outdoors, depths); });
}
