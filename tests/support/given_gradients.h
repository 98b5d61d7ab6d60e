// SPDX-License-Identifier: MIT
// What tests of gradients by a view share: a background, the reference's settings for it, and a
// random dL/d(image).
#pragma once

#include "engine/core/image.h"
#include "engine/core/rng.h"
#include "engine/reference/reference_render.h"
#include "engine/scene/camera.h"
#include "shaders/shared/limits.h"

namespace darb::test {

inline const glm::vec3 kBackground(0.25f, 0.5f, 0.75f);

/// [H][W][channels], with numbers between -1 and 1.
inline ImageF random_image(const Camera& camera, int channels, std::uint64_t seed) {
    Pcg32 rng(seed);
    ImageF image(camera.width, camera.height, channels);
    for (float& w : image.data) w = static_cast<float>(rng.uniform(-1, 1));
    return image;
}

inline reference::RenderSettings truth_settings() {
    reference::RenderSettings settings;
    settings.near_z = static_cast<float>(NEAR_DEFAULT);
    settings.threads = 1;
    for (int c = 0; c < 3; ++c) settings.background[c] = kBackground[c];
    return settings;
}

}  // namespace darb::test
