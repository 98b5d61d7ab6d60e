// SPDX-License-Identifier: MIT
// DisplaySettings: how a scene is shown, as the panels edit it.
#pragma once

#include <glm/glm.hpp>

#include "engine/kernels/kernel_family.h"
#include "engine/plan/accuracy.h"
#include "shaders/shared/limits.h"
#include "shaders/shared/view_args.h"

namespace darb {

/// splats: as they are; points: a dot at each mean; ellipsoids: nearly opaque ellipses with hard
/// edges at two standard deviations.
enum class SplatStyle { splats, points, ellipsoids };

/// What is seen of a mesh, where there is one and the picture shows colours. both: splats before
/// its surface hide it, and it hides those behind; beside: it has a pane of its own (panes.h).
enum class MeshShow { none, alone, both, beside };
/// As MESH_* of view_args.h.
enum class MeshLook { colours, shape, edges };

struct DisplaySettings {
    int mode = VIEW_COLOUR;  // shaders/shared/view_args.h
    SplatStyle style = SplatStyle::splats;
    int kernel = KERNEL_GAUSSIAN;
    Footprint footprint = Footprint::psi;
    Accuracy accuracy;  // all but footprint and SH degree, which are members here
    int sh_degree = 3;  // highest degree in use
    ProjectionEffects effects;
    HugeSplatPath huge_splat_path = HugeSplatPath::by_counters;
    glm::vec3 background{0.0f};
    float near_plane = static_cast<float>(NEAR_DEFAULT);  // world units
    float error_max = 0.25f;   // mean absolute difference that gets the hottest colour
    float count_max = 500.0f;  // intersections that get the hottest colour
    MeshShow mesh = MeshShow::none;
    MeshLook mesh_look = MeshLook::colours;
    float mesh_nearer = 0.005f;  // share of the depth by which a mesh among splats counts as nearer

    bool operator==(const DisplaySettings&) const = default;
};

}  // namespace darb
