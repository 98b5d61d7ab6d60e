// SPDX-License-Identifier: MIT
// Random splats in front of a random camera; a seed gives the same ones on every platform.
#pragma once

#include <cstdint>

#include "engine/scene/camera.h"
#include "engine/scene/splat_model.h"

namespace darb::reference {

struct SceneOptions {
    size_t count = 10;  // splats
    int width = 32;     // px
    int height = 24;    // px
    int kernel = KERNEL_GAUSSIAN;
    Footprint footprint = Footprint::psi;
    int sh_degree = 3;
    bool antialias = false;
    double min_log_scale = -2.5, max_log_scale = -0.8;  // natural log of world units
    double min_logit = -1, max_logit = 2;
    std::uint64_t seed = 1;
};

struct TestScene {
    SplatModel model;
    Camera camera;
};

/// Splats in the cube [-1, 1]^3, and a rotated camera, about 3 from the cube's centre, that sees
/// most of it, with an off-centre principal point and unequal focal lengths.
TestScene random_scene(const SceneOptions& options = {});

/// The rotation given by a quaternion w x y z of any norm, for cameras.
glm::dmat3 rotation_of(double w, double x, double y, double z);

}  // namespace darb::reference
