// SPDX-License-Identifier: MIT
#include "tools/bench/scenes.h"

#include <cmath>
#include <numbers>

#include "engine/core/error.h"
#include "engine/core/rng.h"

namespace darb {

SplatModel random_scene(std::size_t splats, int sh_degree) {
    SplatModel model;
    model.sh_degree = sh_degree;
    model.resize(splats);
    Pcg32 random(1, 100);
    const auto normal = [&](double mean, double deviation) {
        return static_cast<float>(mean + deviation * random.normal());
    };
    const std::size_t rest = static_cast<std::size_t>(model.rest_count());
    for (std::size_t i = 0; i < splats; ++i) {
        glm::dvec3 p;
        do
            for (int a = 0; a < 3; ++a) p[a] = random.uniform(-1, 1);
        while (glm::dot(p, p) > 1);
        for (std::size_t a = 0; a < 3; ++a) {
            const double coordinate = p[static_cast<int>(a)];
            model.position[3 * i + a] = static_cast<float>(coordinate);
            model.log_scale[3 * i + a] = normal(std::log(0.01), 0.4);
            model.sh_dc[3 * i + a] = static_cast<float>(0.5 * coordinate / SH_C0);
        }
        for (std::size_t a = 0; a < 4; ++a) model.rotation[4 * i + a] = normal(0, 1);
        model.opacity_logit[i] = normal(0, 1.5);
        for (std::size_t a = 0; a < rest; ++a) model.sh_rest[rest * i + a] = normal(0, 0.05);
    }
    return model;
}

SplatModel filled_scene(std::size_t splats) {
    SplatModel model = random_scene(splats);
    Pcg32 random(2, 100);
    const double half = 0.99 * std::tan(0.125 * std::numbers::pi);  // half the width, at distance 1
    for (std::size_t i = 0; i < splats; ++i) {
        const double distance = random.uniform(3, 5);
        model.position[3 * i] = static_cast<float>(random.uniform(-half, half) * distance);
        model.position[3 * i + 1] = static_cast<float>(random.uniform(-half, half) * distance);
        model.position[3 * i + 2] = static_cast<float>(4 - distance);
        model.opacity_logit[i] = static_cast<float>(-3.2 + 1.2 * random.normal());
        for (std::size_t a = 0; a < 3; ++a) {
            model.log_scale[3 * i + a] += std::log(1.75f);
            model.sh_dc[3 * i + a] = static_cast<float>(random.normal());
        }
    }
    return model;
}

Camera bench_camera(const glm::dvec3& centre, bool upright, int width, int height) {
    Camera camera;
    camera.width = width;
    camera.height = height;
    camera.fx = camera.fy = 0.5 * width / std::tan(0.125 * 3.14159265358979323846);
    camera.cx = 0.5 * width;
    camera.cy = 0.5 * height;
    const double side = upright ? 1 : -1;
    const glm::dvec3 right(side, 0, 0), down(0, -side, 0), forward(0, 0, -1);
    camera.rotation = glm::transpose(glm::dmat3(right, down, forward));
    camera.translation = -(camera.rotation * centre);
    return camera;
}

View bench_view(const Camera& camera, const std::string& name) {
    View view;
    view.name = name;
    view.camera = camera;
    view.lens = {
        "PINHOLE", {camera.fx, camera.fy, camera.cx, camera.cy}, camera.width, camera.height};
    return view;
}

std::optional<std::filesystem::path> bench_data_folder(const std::filesystem::path& named,
                                                       const std::filesystem::path& usual) {
    std::error_code error;
    if (!named.empty()) {
        if (!std::filesystem::is_directory(named, error))
            throw Error("--data " + named.string(), "is no folder",
                        "Name the folder that holds fox_800, sceaux_castle_800, splats, ...");
        return named;
    }
    if (!std::filesystem::is_directory(usual, error)) return std::nullopt;
    return usual;
}

}  // namespace darb
