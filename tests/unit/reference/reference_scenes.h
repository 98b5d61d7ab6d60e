// SPDX-License-Identifier: MIT
// Scenes of one or a few splats whose image can be worked out by hand, and finite differences.
#pragma once

#include <cmath>

#include "engine/core/rng.h"
#include "engine/reference/reference_render.h"

namespace darb::test {

using reference::RenderResult;
using reference::RenderSettings;
using reference::Splats;

/// Identity pose, focal 4, principal point on the centre of pixel (4, 3) of 9 x 7.
inline Camera small_camera() {
    Camera camera;
    camera.width = 9;
    camera.height = 7;
    camera.fx = camera.fy = 4;
    camera.cx = 4.5;
    camera.cy = 3.5;
    return camera;
}

struct OneSplat {
    glm::dvec3 position{0, 0, 2};
    glm::dvec3 log_scale{-4.0};
    glm::dvec4 rotation{1, 0, 0, 0};  // w x y z
    double logit = 0;                 // opacity 1/2
    glm::dvec3 colour{1.0};           // as rendered, without bands above 0
};

inline void add_splat(Splats<double>& splats, const OneSplat& one) {
    constexpr double kBand0 = 0.28209479177387814;
    for (int c = 0; c < 3; ++c) {
        splats.position.push_back(one.position[c]);
        splats.log_scale.push_back(one.log_scale[c]);
        splats.sh_dc.push_back((one.colour[c] - 0.5) / kBand0);
    }
    for (int c = 0; c < 4; ++c) {
        splats.rotation.push_back(one.rotation[c]);
    }
    splats.opacity_logit.push_back(one.logit);
    splats.sh_rest.resize(splats.size() * splats.rest_count());
}

inline Splats<double> splats_of(std::initializer_list<OneSplat> all, int kernel = KERNEL_GAUSSIAN) {
    Splats<double> splats;
    splats.kernel = kernel;
    for (const OneSplat& one : all) {
        add_splat(splats, one);
    }
    return splats;
}

/// Standard normal weights: a loss that no symmetric mistake survives.
inline Image<double> random_weights(const Camera& camera, int channels, std::uint64_t seed) {
    Pcg32 rng(seed);
    Image<double> weights(camera.width, camera.height, channels);
    for (double& weight : weights.data) {
        weight = rng.normal();
    }
    return weights;
}

inline double weighted_sum(const Image<double>& image, const Image<double>& weights) {
    double sum = 0;
    for (size_t i = 0; i < image.data.size(); ++i) {
        sum += image.data[i] * weights.data[i];
    }
    return sum;
}

}  // namespace darb::test
