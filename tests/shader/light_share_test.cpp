// SPDX-License-Identifier: MIT
// The light of splats in pictures, against the reference, which draws each splat alone white.
#include <gtest/gtest.h>

#include "engine/core/rng.h"
#include "engine/reference/reference_render.h"
#include "engine/render/light_share.h"
#include "shaders/shared/attribute_list.h"
#include "tests/support/shared_device.h"
#include "tests/support/test_scene.h"

namespace darb::test {
namespace {

// [camera][splat] the sum of T alpha over the pixels: one splat white, the others black.
std::vector<std::vector<double>> reference_light(const SplatModel& model,
                                                 const std::vector<Camera>& cameras) {
    std::vector<std::vector<double>> light;
    for (const Camera& camera : cameras) {
        light.emplace_back();
        for (std::size_t i = 0; i < model.size(); ++i) {
            SplatModel one = model;
            for (std::size_t k = 0; k < one.sh_dc.size(); ++k)
                one.sh_dc[k] = static_cast<float>((k / 3 == i ? 0.5 : -0.5) / SH_C0);
            const auto result = reference::render(one, camera, {});
            double sum = 0;
            for (std::size_t p = 0; p < result.images.colour.data.size(); p += 3)
                sum += result.images.colour.data[p];
            light.back().push_back(sum);
        }
    }
    return light;
}

struct Views {
    SplatModel model;
    std::vector<Camera> cameras;
};

// A camera that looks at all, and others that turn away step by step.
Views turning_away(bool antialias) {
    TestScene scene =
        random_scene({.count = 40, .sh_degree = 0, .antialias = antialias, .seed = 5});
    Views views{scene.model, {}};
    for (int v = 0; v < 5; ++v) {
        Camera camera = scene.camera;
        const glm::dmat3 turn = rotation_of(1, 0, 0.12 * v, 0);
        camera.rotation = turn * camera.rotation;
        camera.translation = turn * camera.translation;
        views.cameras.push_back(camera);
    }
    return views;
}

constexpr double kSeen = 1e-3;  // share of a pixel's light: below it, float32 and double may
                                // disagree

TEST(LightShare, views_that_see_a_splat_are_those_in_which_the_reference_blends_it) {
    for (const bool antialias : {false, true}) {
        const Views views = turning_away(antialias);
        const auto light = reference_light(views.model, views.cameras);
        const std::vector<std::uint32_t> seen =
            views_that_see(shared_device(), views.model, views.cameras);
        std::size_t few = 0, decided = 0;
        for (std::size_t i = 0; i < views.model.size(); ++i) {
            std::uint32_t sure = 0, possible = 0;
            for (const auto& view : light) {
                sure += view[i] > kSeen ? 1 : 0;
                possible += view[i] > 1e-9 ? 1 : 0;
            }
            EXPECT_GE(seen[i], sure) << i;
            EXPECT_LE(seen[i], possible) << i;
            few += seen[i] < 3 ? 1 : 0;
            decided += sure == possible ? 1 : 0;
        }
        EXPECT_GT(few, 3u);
        EXPECT_LT(few, 35u);
        EXPECT_GT(decided, 35u);
    }
}

TEST(LightShare, shares_are_those_of_the_reference) {
    const Views views = turning_away(false);
    const auto light = reference_light(views.model, views.cameras);
    std::vector<std::uint8_t> chosen;
    for (std::size_t i = 0; i < views.model.size(); ++i) chosen.push_back(i % 3 == 0 ? 1 : 0);
    const std::vector<double> shares =
        light_shares(shared_device(), views.model, chosen, views.cameras);
    for (std::size_t c = 0; c < views.cameras.size(); ++c) {
        double part = 0, all = 0;
        for (std::size_t i = 0; i < chosen.size(); ++i) {
            part += chosen[i] * light[c][i];
            all += light[c][i];
        }
        ASSERT_GT(part, 1.0) << c;
        EXPECT_NEAR(shares[c], part / all, 1e-4) << c;
    }
}

TEST(LightShare, nothing_has_no_share) {
    const Views views = turning_away(false);
    EXPECT_EQ(light_shares(shared_device(), SplatModel{}, {}, views.cameras),
              std::vector<double>(views.cameras.size(), 0.0));
    EXPECT_TRUE(views_that_see(shared_device(), SplatModel{}, views.cameras).empty());
}

}  // namespace
}  // namespace darb::test
