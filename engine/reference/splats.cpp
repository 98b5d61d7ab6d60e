// SPDX-License-Identifier: MIT
#include "engine/reference/splats.h"

#include <cmath>

#include "engine/core/rng.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/scene/splat_model.h"

namespace darb::reference {
namespace {

constexpr double kDistance = 3;  // camera to the cube's centre, world units

Camera random_camera(const SceneOptions& options, Pcg32& rng) {
    Camera camera;
    camera.width = options.width;
    camera.height = options.height;
    const double focal = options.width * rng.uniform(0.9, 1.1);
    camera.fx = focal;
    camera.fy = focal * rng.uniform(0.95, 1.05);
    camera.cx = options.width * rng.uniform(0.42, 0.58);
    camera.cy = options.height * rng.uniform(0.42, 0.58);
    const double w = rng.normal(), x = rng.normal(), y = rng.normal(), z = rng.normal();
    camera.rotation = rotation_of(w, x, y, z);
    camera.translation = {rng.uniform(-0.2, 0.2), rng.uniform(-0.2, 0.2), kDistance};
    return camera;
}

}  // namespace

glm::dmat3 rotation_of(double w, double x, double y, double z) {
    // Columns are the images of the axes: v + 2 (w u x v + u x (u x v)) / |q|^2, u = (x, y, z).
    const glm::dvec3 u(x, y, z);
    const double square = w * w + glm::dot(u, u);
    glm::dmat3 rotation(1.0);
    for (int c = 0; c < 3; ++c) {
        const glm::dvec3 once = glm::cross(u, rotation[c]);
        rotation[c] += 2.0 * (w * once + glm::cross(u, once)) / square;
    }
    return rotation;
}

TestScene random_scene(const SceneOptions& options) {
    Pcg32 rng(options.seed);
    TestScene scene;
    scene.camera = random_camera(options, rng);
    SplatModel& model = scene.model;
    model.sh_degree = options.sh_degree;
    model.kernel = options.kernel;
    model.footprint = options.footprint;
    model.antialias = options.antialias;
    model.resize(options.count);
    const auto fill = [](std::vector<float>& values, const auto& draw) {
        for (float& value : values) {
            value = static_cast<float>(draw());
        }
    };
    fill(model.position, [&] { return rng.uniform(-1, 1); });
    fill(model.log_scale,
         [&] { return rng.uniform(options.min_log_scale, options.max_log_scale); });
    fill(model.rotation, [&] { return rng.normal(); });
    fill(model.opacity_logit, [&] { return rng.uniform(options.min_logit, options.max_logit); });
    fill(model.sh_dc, [&] { return rng.uniform(-0.5, 1.5); });
    fill(model.sh_rest, [&] { return rng.uniform(-0.1, 0.1); });
    set_kernel(model, options.kernel);
    if (kernel_has_shape(options.kernel)) {
        const ShapedKernel& kernel = shaped_kernel(options.kernel);
        const double from = kernel.first_shape() - 0.1, to = kernel.last_shape() + 0.2;
        fill(model.shape, [&] { return rng.uniform(from, to); });  // some are clamped at either end
    }
    return scene;
}

}  // namespace darb::reference
