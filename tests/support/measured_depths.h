// SPDX-License-Identifier: MIT
// Depth files for the views of a tiny training, made from its true splats.
#pragma once

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>

#include "engine/data/depth_io.h"
#include "tests/support/tiny_training.h"

namespace darb::test {

/// Gives every view but `without` the depths of `truth`, with a unit of one metre, where these
/// splats cover at least half of a pixel.
inline void add_measured_depths(const SplatModel& truth, TinyTraining& t, int without = -1) {
    const auto folder =
        std::filesystem::temp_directory_path() / fmt::format("darb_depths_{}", ::getpid());
    Renderer renderer(shared_device(), truth);
    for (size_t v = 0; v < t.dataset.views.size(); ++v) {
        View& view = t.dataset.views[v];
        view.lens.width = view.camera.width;
        view.lens.height = view.camera.height;
        if (static_cast<int>(v) == without) continue;
        renderer.render(view.camera);
        const ImageF depth = renderer.render_depth();
        ImageF measured(depth.width, depth.height, 1);
        for (size_t p = 0; p < measured.data.size(); ++p)
            measured.data[p] = depth.data[2 * p + 1] >= 0.5f ? depth.data[2 * p] : 0.0f;
        view.depth = folder / (view.name + ".png");
        write_depth_png(view.depth, measured, kMillimetre);
    }
}

/// The splats that tiny_training renders.
inline SplatModel tiny_truth(const TinyOptions& tiny = {}) {
    return random_scene({.count = tiny.splats,
                         .width = tiny.width,
                         .height = tiny.height,
                         .sh_degree = 0,
                         .min_log_scale = -2.5,
                         .max_log_scale = -1.5,
                         .seed = 91})
        .model;
}

}  // namespace darb::test
