// What `darb convert` changes of a scene, and the options that say so.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "engine/scene/splat_model.h"

namespace darb {

/// Made in this order: up, rotate, scale, translate, crop, prune_opacity, max_sh.
struct SceneEdits {
    std::string up = "-y";                // axis of the scene that is turned to -y
    std::string rotate, translate, crop;  // numbers with commas; empty: nothing
    double scale = 1, prune_opacity = 0;
    int max_sh = 3;
};

void add_edit_options(CLI::App& app, SceneEdits& edits);

/// Prints to `say` how many splats go. Throws Error naming the option that cannot be read.
void edit_scene(const SceneEdits& edits, SplatModel& model, std::FILE* say);

}  // namespace darb
