// SPDX-License-Identifier: MIT
// Where a scene without cameras is looked at from, and which way is up.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "engine/core/error.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_file.h"
#include "engine/scene/splat_moves.h"
#include "tests/support/splat_files.h"
#include "tests/support/test_data.h"
#include "viewer/bounds.h"
#include "viewer/navigation.h"
#include "viewer/saved_files.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;

// A ball on a plate, y down as stored.
SplatModel ball_on_a_plate() {
    SplatModel m = sample_model(0, 4000);
    Pcg32 rng(3);
    for (std::size_t i = 0; i < m.size(); ++i) {
        glm::dvec3 p = glm::normalize(glm::dvec3(rng.normal(), rng.normal(), rng.normal()));
        if (i % 2 == 0) p = {3 * rng.uniform() - 1.5, 1.0, 3 * rng.uniform() - 1.5};
        for (std::size_t k = 0; k < 3; ++k) {
            m.position[3 * i + k] = static_cast<float>(p[static_cast<int>(k)]);
            m.log_scale[3 * i + k] = -3;
        }
        m.opacity_logit[i] = 2;
    }
    return m;
}

TEST(GuessUp, what_stands_is_wide_where_it_stands) {
    SplatModel m = ball_on_a_plate();
    EXPECT_EQ(guess_up(m), glm::dvec3(0, -1, 0));
    transform_splats({.turn = turn_of_degrees({180, 0, 0})}, m);
    EXPECT_EQ(guess_up(m), glm::dvec3(0, 1, 0));
    transform_splats({.turn = turn_of_degrees({90, 0, 0})}, m);
    EXPECT_EQ(guess_up(m), glm::dvec3(0, 0, 1));
    transform_splats({.turn = turn_of_degrees({180, 0, 0})}, m);
    EXPECT_EQ(guess_up(m), glm::dvec3(0, -1, 0)) << "as a wall behind the scene";
    EXPECT_EQ(guess_up(SplatModel()), glm::dvec3(0, -1, 0));
    EXPECT_EQ(guess_up(sample_model(0, 50)), glm::dvec3(0, -1, 0));
}

// Looked at: each stands on its feet with these.
TEST(GuessUp, is_right_for_public_scenes) {
    const auto data = test_data_folder();
    if (!data || !fs::exists(*data / "splats")) GTEST_SKIP() << kNoTestData;
    for (const char* name :
         {"Unicorn_Stuffy_cleaned.sog", "biker.compressed.ply", "biker.decoded.ply", "biker.spz",
          "grimlock.compressed.ply", "gs_Skull_redux.splat", "guitar.compressed.ply", "playbot_sog",
          "toy-cat.compressed.ply", "toy-cat.decoded.ply"}) {
        const double up = std::string(name) == "grimlock.compressed.ply" ? 1 : -1;
        SplatModel model = load_splats(*data / "splats" / name);
        EXPECT_EQ(guess_up(model), glm::dvec3(0, up, 0)) << name;
        if (std::string(name).starts_with("biker") || std::string(name).starts_with("toy-cat"))
            continue;  // no wider below than in front: with z up they lie
        transform_splats({.turn = turn_of_degrees({90 * up, 0, 0})}, model);
        EXPECT_EQ(guess_up(model), glm::dvec3(0, 0, 1)) << name;
    }
}

TEST(FramingDistance, shows_the_scene_and_no_more) {
    SplatModel m = ball_on_a_plate();
    m.origin = {100, -50, 7};
    const Bounds bounds = scene_bounds(m);
    for (const double tan_x : {0.2, 0.8})
        for (const double turn : {0.0, 40.0}) {
            const glm::dmat3 axes = turn_of_degrees({turn, turn, 0});
            const double distance = framing_distance(m, bounds, axes, tan_x, 0.4);
            double widest = 0;
            std::size_t outside = 0;
            for (std::size_t i = 0; i < m.size(); ++i) {
                const glm::dvec3 p = glm::transpose(axes) * (position_of(m, i) - bounds.centre);
                const double edge =
                    std::max(std::abs(p.x) / tan_x, std::abs(p.y) / 0.4) / (p.z + distance);
                outside += edge > 1;
                widest = std::max(widest, edge);
            }
            EXPECT_LE(outside, 2u) << tan_x;
            EXPECT_GE(widest, 0.85) << tan_x;  // 1.5 deviations of 0.05 more are seen
        }
    SplatModel few = sample_model(0, 1);  // a single wide splat is seen whole
    std::fill(few.position.begin(), few.position.end(), 0.0f);
    std::fill(few.log_scale.begin(), few.log_scale.end(), 0.0f);
    EXPECT_NEAR(framing_distance(few, {{0, 0, 0}, 30}, glm::dmat3(1.0), 1, 1), 1.5 * std::sqrt(2.0),
                1e-5);
    EXPECT_EQ(framing_distance(SplatModel(), Bounds(), glm::dmat3(1.0), 1, 1), 0);
}

TEST(TurnToUp, takes_any_up_to_minus_y) {
    for (const glm::dvec3& up : {glm::dvec3(0, 1, 0), glm::dvec3(0, -1, 0), glm::dvec3(1, 0, 0),
                                 glm::normalize(glm::dvec3(0.3, 0.5, -2))}) {
        const glm::dmat3 turn = turn_to_up(up);
        EXPECT_LT(glm::distance(turn * up, glm::dvec3(0, -1, 0)), 1e-12);
        EXPECT_NEAR(glm::determinant(turn), 1, 1e-12);
    }
}

TEST(RememberedUp, is_kept_by_file_and_never_over_another_list) {
    const fs::path folder = fs::temp_directory_path() / ("darb_up_" + std::to_string(::getpid()));
    const fs::path list = folder / "state" / "up.json";
    const RememberedUp up(list);
    EXPECT_FALSE(up.find("a.ply"));
    const std::string hostile = "b\"]}\n\xff.ply";
    up.keep("a.ply", {0, 0, 1});
    up.keep(hostile, {0, 1, 0});
    up.keep("a.ply", {1, 0, 0});
    EXPECT_EQ(up.find("a.ply"), glm::dvec3(1, 0, 0));
    EXPECT_EQ(up.find(fs::current_path() / "a.ply"), glm::dvec3(1, 0, 0));
    EXPECT_FALSE(up.find("c.ply"));
    for (const char* bad : {"{", "{}", "[1, {\"scene\": 3}, {\"scene\": \"a.ply\", \"up\": 7}]"}) {
        std::ofstream(list) << bad;
        EXPECT_FALSE(up.find("a.ply")) << bad;
    }
    std::ofstream(list) << "{}";
    EXPECT_THROW(up.keep("a.ply", {1, 0, 0}), Error);
    EXPECT_EQ(fs::file_size(list), 2u);
    RememberedUp().keep("a.ply", {1, 0, 0});
    fs::remove_all(folder);
}

}  // namespace
}  // namespace darb::test
