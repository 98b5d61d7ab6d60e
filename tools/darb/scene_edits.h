// What `darb convert` changes of a scene, and the options that say so; several scenes as one.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "engine/data/dataset.h"
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
/// Cameras of the scene as it was see the same of the edited one: up, rotate, scale, translate.
void edit_views(const SceneEdits& edits, std::vector<View>& views);
/// Where an axis of the scene as it was, named as --up takes it, points in the edited one. Unit.
glm::dvec3 edited_axis(const SceneEdits& edits, const std::string& axis);

/// The splats of all, in order, in the world frame of their files. Harmonics have the highest
/// degree of them, with zeros where a scene has fewer. Positions are counted from the origin of the
/// first; where float32 cannot keep another scene's positions that way, all are counted anew, and a
/// note says by how much they are rounded. names: of the files, in errors and notes. Throws Error
/// where kernels, footprints or render modes differ.
SplatModel join_scenes(std::vector<SplatModel> scenes,
                       const std::vector<std::filesystem::path>& names);

}  // namespace darb
