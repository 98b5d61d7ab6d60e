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

    bool operator==(const DisplaySettings&) const = default;
};

}  // namespace darb
