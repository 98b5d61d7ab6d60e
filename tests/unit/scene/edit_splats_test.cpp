// SPDX-License-Identifier: MIT
#include "engine/scene/edit_splats.h"

#include <cmath>
#include <limits>

#include "shaders/shared/limits.h"
#include "tests/support/splat_files.h"

namespace darb::test {
namespace {

const glm::dmat3 kTurn = rotation_of(0.3, -0.8, 0.4, 0.5);
const glm::dmat3 kMirror(1, 0, 0, 0, -1, 0, 0, 0, 1);

/// Colour of splat i without its constant part, in a direction of unit length.
glm::dvec3 view_colour(const SplatModel& model, size_t i, const glm::dvec3& direction) {
    const auto basis = sh_basis(model.sh_degree, direction.x, direction.y, direction.z);
    const auto rest = static_cast<size_t>(model.rest_count());
    glm::dvec3 colour(0.0);
    for (size_t c = 0; c < rest; ++c)
        colour[static_cast<int>(c % 3)] += basis[1 + c / 3] * model.sh_rest[rest * i + c];
    return colour;
}

TEST(ShRotation, colours_turn_with_the_scene) {
    for (const glm::dmat3& turn : {kTurn, kMirror, kMirror * kTurn, turn_of_up_axis("z")})
        for (int degree = 1; degree <= 3; ++degree) {
            const SplatModel before = sample_model(degree, 4);
            SplatModel after = before;
            rotate_sh(sh_rotation(turn), degree, after.sh_rest);
            Pcg32 rng(5);
            for (int n = 0; n < 50; ++n) {
                const glm::dvec3 d =
                    glm::normalize(glm::dvec3(rng.normal(), rng.normal(), rng.normal()));
                for (size_t i = 0; i < before.size(); ++i)
                    for (int k = 0; k < 3; ++k)
                        EXPECT_NEAR(view_colour(after, i, turn * d)[k],
                                    view_colour(before, i, d)[k], 1e-6);
            }
        }
}

TEST(ShRotation, bands_are_orthogonal_and_compose) {
    const ShRotation a = sh_rotation(kTurn), b = sh_rotation(kMirror),
                     both = sh_rotation(kMirror * kTurn);
    for (size_t l = 1; l <= 3; ++l)
        for (size_t j = 0; j < 2 * l + 1; ++j)
            for (size_t k = 0; k < 2 * l + 1; ++k) {
                double product = 0, composed = 0;
                for (size_t m = 0; m < 2 * l + 1; ++m) {
                    product += a[l][j][m] * a[l][k][m];
                    composed += b[l][j][m] * a[l][m][k];
                }
                EXPECT_NEAR(product, j == k, 1e-13);
                EXPECT_NEAR(composed, both[l][j][k], 1e-13);
            }
}

TEST(EditSplats, similarities_move_positions_covariances_and_colours) {
    const SplatModel before = sample_model(2, 20);
    for (const glm::dmat3& turn : {kTurn, kMirror * kTurn}) {
        SplatModel after = before;
        const Similarity s{2.5, turn, {1, -2, 3}};
        transform_splats(s, after);
        for (size_t i = 0; i < before.size(); ++i) {
            const glm::dvec3 p = s.scale * (turn * position_of(before, i)) + s.translation;
            EXPECT_LT(glm::distance(position_of(after, i), p), 1e-6);
            const glm::dmat3 expected =
                s.scale * s.scale * (turn * covariance_of(before, i) * glm::transpose(turn));
            const glm::dmat3 got = covariance_of(after, i);
            for (int a = 0; a < 3; ++a)
                EXPECT_LT(glm::distance(got[a], expected[a]),
                          1e-5 * glm::length(expected[a]) + 1e-6);
        }
    }
}

TEST(EditSplats, a_turn_and_its_inverse_cancel) {
    const SplatModel before = sample_model(3, 10);
    SplatModel after = before;
    transform_splats({2, kTurn, {0, 0, 0}}, after);
    transform_splats({0.5, glm::transpose(kTurn), {0, 0, 0}}, after);
    for (size_t i = 0; i < before.position.size(); ++i)
        EXPECT_NEAR(after.position[i], before.position[i], 1e-6);
    for (size_t i = 0; i < before.sh_rest.size(); ++i)
        EXPECT_NEAR(after.sh_rest[i], before.sh_rest[i], 1e-7);
    for (size_t i = 0; i < before.size(); ++i)
        EXPECT_NEAR(same_rotation(before, i, after, i), 1, 1e-6);
}

TEST(EditSplats, scenes_moved_far_away_keep_their_precision) {
    SplatModel model = sample_model(0, 10);
    const SplatModel before = model;
    transform_splats({1, glm::dmat3(1.0), {500000, 0, 0}}, model);
    EXPECT_GT(model.origin.x, 499990);
    for (size_t i = 0; i < model.size(); ++i)
        EXPECT_LT(
            glm::distance(position_of(model, i), position_of(before, i) + glm::dvec3(500000, 0, 0)),
            1e-6);
}

TEST(EditSplats, positions_are_counted_from_where_most_of_them_are) {
    std::vector<double> positions;
    for (int i = 0; i < 100; ++i)
        for (const double axis : {70'000.1, -0.3, 5.0}) positions.push_back(axis + 0.01 * i);
    for (const double far : {1e9, 0.3, -1e8}) positions.push_back(far);
    SplatModel model;
    model.resize(101);
    set_positions(positions, model);
    EXPECT_NEAR(model.origin.x, 70'000.6, 0.3);
    EXPECT_EQ(model.origin.y, 0);
    EXPECT_EQ(model.origin.z, 0);
    for (size_t i = 0; i < 300; ++i)
        EXPECT_NEAR(model.origin[int(i % 3)] + model.position[i], positions[i], 1e-6) << i;
}

TEST(EditSplats, positions_at_both_ends_of_float32_stay_finite) {
    const double most = 3.4e38;
    std::vector<double> positions(12, most);
    positions[0] = positions[1] = positions[2] = -most;
    SplatModel model;
    model.resize(4);
    set_positions(positions, model);
    for (const float p : model.position) EXPECT_TRUE(std::isfinite(p)) << p;
}

TEST(EditSplats, one_far_splat_leaves_float32_numbers_as_they_are) {
    SplatModel model;
    model.resize(3);
    set_positions({0.1f, -0.3f, 0.25f, 7e4f, 1.5f, 3, 1e8f, -1e12f, 0.7f}, model);
    EXPECT_EQ(model.origin, glm::dvec3(0));
    EXPECT_EQ(model.position,
              (std::vector<float>{0.1f, -0.3f, 0.25f, 7e4f, 1.5f, 3, 1e8f, -1e12f, 0.7f}));
}

TEST(EditSplats, every_up_axis_ends_at_minus_y) {
    const std::pair<const char*, glm::dvec3> axes[] = {{"x", {1, 0, 0}},   {"y", {0, 1, 0}},
                                                       {"z", {0, 0, 1}},   {"-x", {-1, 0, 0}},
                                                       {"-y", {0, -1, 0}}, {"-z", {0, 0, -1}}};
    for (const auto& [name, axis] : axes) {
        const glm::dmat3 turn = turn_of_up_axis(name);
        EXPECT_LT(glm::distance(turn * axis, glm::dvec3(0, -1, 0)), 1e-15) << name;
        EXPECT_NEAR(glm::determinant(turn), 1, 1e-15) << name;
    }
    EXPECT_NE(error_of([] { turn_of_up_axis("up"); }).find("no axis"), std::string::npos);
}

TEST(EditSplats, degrees_turn_about_x_then_y_then_z) {
    const glm::dvec3 y = turn_of_degrees({90, 0, 0}) * glm::dvec3(0, 1, 0);
    EXPECT_LT(glm::distance(y, glm::dvec3(0, 0, 1)), 1e-15);
    const glm::dvec3 both = turn_of_degrees({90, 90, 0}) * glm::dvec3(0, 1, 0);  // z, then x
    EXPECT_LT(glm::distance(both, glm::dvec3(1, 0, 0)), 1e-15);
}

TEST(EditSplats, chosen_splats_keep_their_order_and_values) {
    const SplatModel before = sample_model(1, 9);
    SplatModel model = before;
    EXPECT_EQ(keep_splats([](size_t i) { return i % 3 == 1; }, model), 6u);
    ASSERT_EQ(model.size(), 3u);
    EXPECT_EQ(model.opacity_logit[2], before.opacity_logit[7]);
    EXPECT_EQ(model.sh_rest[9], before.sh_rest[4 * 9]);
    EXPECT_EQ(model.rotation[4], before.rotation[16]);
}

TEST(EditSplats, picked_splats_come_in_the_order_asked_for) {
    SplatModel model = sample_model(2, 5);
    model.kernel = KERNEL_RAISED_COSINE;
    model.antialias = true;
    model.origin = {1, 2, 3};
    const SplatModel two = pick_splats(model, {4, 1});
    ASSERT_EQ(two.size(), 2u);
    EXPECT_EQ(two.kernel, model.kernel);
    EXPECT_TRUE(two.antialias);
    EXPECT_EQ(two.origin, model.origin);
    for (size_t k = 0; k < 2; ++k) {
        const size_t from = k == 0 ? 4 : 1;
        EXPECT_EQ(two.opacity_logit[k], model.opacity_logit[from]);
        EXPECT_EQ(two.position[3 * k + 2], model.position[3 * from + 2]);
        EXPECT_EQ(two.log_scale[3 * k], model.log_scale[3 * from]);
        EXPECT_EQ(two.rotation[4 * k + 3], model.rotation[4 * from + 3]);
        EXPECT_EQ(two.sh_dc[3 * k + 1], model.sh_dc[3 * from + 1]);
        EXPECT_EQ(two.sh_rest[24 * k + 23], model.sh_rest[24 * from + 23]);
    }
}

TEST(EditSplats, crop_prune_and_degree) {
    SplatModel model = sample_model(3, 200);
    const SplatModel before = model;
    const size_t outside = crop_splats({-0.5, -1, -1}, {1, 1, 0.5}, model);
    EXPECT_GT(outside, 20u);
    EXPECT_EQ(outside + model.size(), before.size());
    for (size_t i = 0; i < model.size(); ++i) {
        EXPECT_GE(model.position[3 * i], -0.5f);
        EXPECT_LE(model.position[3 * i + 2], 0.5f);
    }
    prune_opacity(0.25, model);
    for (const float logit : model.opacity_logit) EXPECT_GE(opacity_of(logit), 0.25);
    const std::vector<float> third = model.sh_rest;
    limit_sh_degree(1, model);
    EXPECT_EQ(model.sh_rest.size(), 9 * model.size());
    for (size_t c = 0; c < 9; ++c) EXPECT_EQ(model.sh_rest[9 + c], third[45 + c]);
    limit_sh_degree(2, model);
    EXPECT_EQ(model.sh_degree, 1);  // none are made up
}

// What is as opaque as the limit is drawn, and what float32 may take for that stays.
TEST(EditSplats, undrawn_splats_go_but_for_the_first_and_those_near_the_limit) {
    SplatModel model = sample_model(1, 6);
    const auto logit = [](double opacity) {
        return static_cast<float>(std::log(opacity / (1 - opacity)));
    };
    const double cutoff = ALPHA_CUTOFF_DEFAULT;
    model.opacity_logit = {
        -9, logit(0.5), -9, logit(cutoff), logit(cutoff * (1 - 1e-6)), logit(cutoff * 0.999)};
    const SplatModel before = model;
    EXPECT_EQ(drop_undrawn(cutoff, 1, model), 2u);
    EXPECT_EQ(model.opacity_logit,
              (std::vector<float>{before.opacity_logit[0], before.opacity_logit[1],
                                  before.opacity_logit[3], before.opacity_logit[4]}));
    EXPECT_EQ(model.position[6], before.position[9]) << "all that is of a splat goes with it";
    EXPECT_EQ(drop_undrawn(cutoff, 0, model), 1u);
    EXPECT_EQ(drop_undrawn(cutoff, 0, model), 0u);
}

TEST(EditSplats, splats_with_nan_go) {
    SplatModel model = sample_model(1, 4);
    model.sh_rest[9] = std::numeric_limits<float>::quiet_NaN();
    model.log_scale[9] = std::numeric_limits<float>::infinity();
    EXPECT_EQ(drop_non_finite(model), 2u);
    EXPECT_EQ(model.size(), 2u);
}

TEST(EditSplats, infinite_opacity_and_no_extent_are_kept_at_the_limits) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    SplatModel model = sample_model(0, 3);
    model.opacity_logit = {kInfinity, -kInfinity, 2};
    model.log_scale[7] = -kInfinity;
    EXPECT_EQ(drop_non_finite(model), 0u);
    EXPECT_EQ(model.opacity_logit,
              (std::vector<float>{OPACITY_LOGIT_LIMIT, -OPACITY_LOGIT_LIMIT, 2}));
    EXPECT_EQ(model.log_scale[7], -LOG_SCALE_LIMIT);
}

}  // namespace
}  // namespace darb::test
