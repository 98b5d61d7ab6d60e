// What training starts from, for clouds that have no distances to measure.
#include <gtest/gtest.h>

#include <cmath>

#include "trainer/initial_model.h"

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
    for (const auto* values : {&model.position, &model.log_scale, &model.rotation, &model.opacity,
                               &model.sh_dc, &model.sh_rest})
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

TEST(InitialModel, no_points_become_random_ones) {
    TrainOptions options;
    options.random_points = 50;
    const SplatModel model = initial_model(looking_at(0, false), options);
    ASSERT_EQ(model.size(), 50U);
    expect_finite(model);
}

}  // namespace
}  // namespace darb::test
