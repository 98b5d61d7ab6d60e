// SPDX-License-Identifier: MIT
// What training starts from, for clouds that have no distances to measure.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "trainer/growth/initial_model.h"

namespace darb::test {
namespace {

Dataset looking_at(size_t points, bool same_place) {
    Dataset d;
    View view;
    view.camera.width = view.camera.height = 32;
    view.camera.fx = view.camera.fy = 30;
    view.camera.cx = view.camera.cy = 16;
    view.camera.translation.z = 3;
    d.views.push_back(view);
    for (size_t i = 0; i < points; ++i)
        for (int c = 0; c < 3; ++c) {
            d.points.position.push_back(same_place ? 0.5 : 0.1 * static_cast<double>(i));
            d.points.colour.push_back(100);
        }
    return d;
}

void expect_finite(const SplatModel& model) {
    for (const auto* values : {&model.position, &model.log_scale, &model.rotation,
                               &model.opacity_logit, &model.sh_dc, &model.sh_rest})
        for (const float v : *values) ASSERT_TRUE(std::isfinite(v));
}

TEST(InitialModel, duplicate_points_have_a_finite_scale) {
    const SplatModel model = initial_model(looking_at(20, true), {});
    ASSERT_EQ(model.size(), 20U);
    expect_finite(model);
    EXPECT_NEAR(model.log_scale[0], 0.5 * std::log(1e-7), 1e-5);
}

TEST(InitialModel, one_point_and_two_points_are_models) {
    for (const size_t n : {1U, 2U}) {
        const SplatModel model = initial_model(looking_at(n, false), {});
        ASSERT_EQ(model.size(), n);
        expect_finite(model);
    }
}

TEST(InitialModel, map_coordinates_keep_millimetres) {
    Dataset d = looking_at(20, false);
    const glm::dvec3 corner(431'000.25, 5'412'000.5, 812.125);
    for (size_t i = 0; i < d.points.position.size(); ++i)
        d.points.position[i] += corner[int(i % 3)];
    const SplatModel model = initial_model(d, {});
    for (size_t i = 0; i < d.points.position.size(); ++i)
        EXPECT_NEAR(model.origin[int(i % 3)] + model.position[i], d.points.position[i], 1e-6);
}

// At 5,000 float32 has steps of 5e-4, beyond what most updates of a small scene are.
TEST(InitialModel, a_scene_off_zero_can_move_by_its_smallest_updates) {
    Dataset d = looking_at(20, false);
    for (double& p : d.points.position) p += 5000.0;
    d.points.position.insert(d.points.position.end(), {1e12, 0, 0});  // moves no median
    d.points.colour.insert(d.points.colour.end(), {0, 0, 0});
    const SplatModel model = initial_model(d, {});
    for (size_t i = 0; i < 60; ++i) {
        const float p = model.position[i];
        EXPECT_LT(std::nextafter(std::abs(p), 1e9f) - std::abs(p), 1e-6f) << i << ": " << p;
    }
}

TEST(InitialModel, a_cap_draws_from_the_whole_cloud) {
    Dataset d = looking_at(1000, false);
    TrainOptions options;
    options.max_splats = 100;
    const SplatModel model = initial_model(d, options);
    ASSERT_EQ(model.size(), 100U);
    EXPECT_EQ(initial_count(d, options), 100U);
    double low = 1e9, high = -1e9;
    std::set<float> places;
    for (size_t i = 0; i < 100; ++i) {
        low = std::min(low, double(model.position[3 * i]));
        high = std::max(high, double(model.position[3 * i]));
        places.insert(model.position[3 * i]);
    }
    EXPECT_LT(low, 10);  // the range is 0 to 99.9
    EXPECT_GT(high, 90);
    EXPECT_EQ(places.size(), 100U) << "a point was drawn twice";
    // Distances are those between the drawn points: ten times as far apart as all.
    double mean = 0;
    for (const float scale : model.log_scale) mean += std::exp(scale) / 300;
    EXPECT_GT(mean, 5 * std::exp(double(initial_model(d, {}).log_scale[3 * 500])));
}

TEST(InitialModel, a_splat_that_shows_less_than_a_gaussian_starts_wider) {
    const Dataset d = looking_at(20, false);
    const auto scale = [&](int kernel, bool lengths_by_area) {
        TrainOptions options;
        options.kernel = kernel;
        options.lengths_by_area = lengths_by_area;
        return std::exp(initial_model(d, options).log_scale[0]);
    };
    const float gaussian = scale(KERNEL_GAUSSIAN, true);
    EXPECT_NEAR(scale(KERNEL_RAISED_COSINE, true), 1.281634f * gaussian, 1e-6f);
    EXPECT_EQ(scale(KERNEL_RAISED_COSINE, false), gaussian);
    EXPECT_EQ(scale(KERNEL_HALF_COSINE_SQUARED, true), gaussian);  // shows more
}

TEST(InitialModel, no_points_become_random_ones) {
    TrainOptions options;
    options.random_points = 50;
    const SplatModel model = initial_model(looking_at(0, false), options);
    ASSERT_EQ(model.size(), 50U);
    expect_finite(model);
}

TEST(InitialModel, a_point_of_a_surface_becomes_a_flat_splat_across_its_normal) {
    Dataset d = looking_at(20, false);
    const float normals[3][3] = {{0, 0, -1}, {0.6f, 0, 0.8f}, {-0.6f, -0.64f, -0.48f}};
    for (const auto& n : normals) {
        d.start.position.insert(d.start.position.end(), {1, 2, 3});
        d.start.colour.insert(d.start.colour.end(), {10, 20, 30});
        d.start.normal.insert(d.start.normal.end(), n, n + 3);
        d.start.spacing.push_back(0.5f);
    }
    TrainOptions options;
    options.start = StartPoints::dense;
    const SplatModel model = initial_model(d, options);
    ASSERT_EQ(model.size(), 3U);
    expect_finite(model);
    for (int i = 0; i < 3; ++i) {
        const float* scale = &model.log_scale[3 * i];
        EXPECT_EQ(scale[0], scale[1]);
        EXPECT_LT(scale[2], scale[0] - 1);
        EXPECT_NEAR(std::exp(scale[0]), 0.3, 0.2);
        const float* q = &model.rotation[4 * i];  // where it turns z to: the third column
        const double third[3] = {2.0 * (q[1] * q[3] + q[0] * q[2]),
                                 2.0 * (q[2] * q[3] - q[0] * q[1]),
                                 1 - 2.0 * (q[1] * q[1] + q[2] * q[2])};
        double along = 0;
        for (int a = 0; a < 3; ++a) along += third[a] * normals[i][a];
        EXPECT_NEAR(std::abs(along), 1, 1e-6) << i;
    }
}

TEST(InitialModel, a_random_start_leaves_the_points_aside) {
    TrainOptions options;
    options.start = StartPoints::random;
    options.random_points = 50;
    const Dataset d = looking_at(20, false);
    EXPECT_TRUE(starts_random(d, options));
    EXPECT_FALSE(starts_random(d, {}));
    EXPECT_EQ(initial_model(d, options).size(), 50U);
}

TEST(InitialModel, points_of_stereo_stand_in_for_those_that_are_not_there) {
    Dataset d = looking_at(0, false);
    d.start = looking_at(7, false).points;
    EXPECT_FALSE(starts_random(d, {}));
    EXPECT_EQ(initial_model(d, {}).size(), 7U);
    TrainOptions options;
    options.start = StartPoints::random;
    EXPECT_TRUE(starts_random(d, options));
}

}  // namespace
}  // namespace darb::test
