// SPDX-License-Identifier: MIT
// The extent of a scene: that of the training views, and a finite value where cameras say nothing.
#include <gtest/gtest.h>

#include "engine/data/dataset.h"

namespace darb {
namespace {

void add_camera(Dataset& dataset, const glm::dvec3& centre, bool is_test = false) {
    dataset.views.emplace_back();
    dataset.views.back().camera.translation = -centre;  // no rotation
    dataset.views.back().is_test = is_test;
}

void add_point(Dataset& dataset, const glm::dvec3& point) {
    for (int c = 0; c < 3; ++c) {
        dataset.points.position.push_back(point[c]);
        dataset.points.colour.push_back(0);
    }
}

TEST(SceneExtent, is_that_of_the_training_cameras) {
    Dataset dataset;
    add_camera(dataset, {-1, 0, 0});
    add_camera(dataset, {1, 0, 0});
    add_camera(dataset, {100, 0, 0}, true);
    add_point(dataset, {0, 0, 5});
    EXPECT_NEAR(scene_extent(dataset), 1.1, 1e-12);
    EXPECT_NEAR(scene_reach(dataset), 2.5, 1e-6) << "half of the way to the points";
}

TEST(SceneExtent, of_cameras_in_one_place_is_the_middle_distance_of_the_points) {
    for (const double apart : {0.0, 1e-12}) {
        Dataset dataset;
        add_camera(dataset, {2, 0, 0});
        add_camera(dataset, {2 + apart, 0, 0});
        for (const double z : {1.0, 7.0, 3.0}) add_point(dataset, {2, 0, z});
        EXPECT_NEAR(scene_extent(dataset), 3, 1e-6) << apart;
    }
}

TEST(SceneExtent, without_anything_to_go_by_is_1) {
    Dataset dataset;
    EXPECT_EQ(scene_extent(dataset), 1);
    add_camera(dataset, {2, 0, 0});
    EXPECT_EQ(scene_extent(dataset), 1);
}

TEST(NearestPoints, are_those_of_each_camera_without_a_few_strays) {
    Dataset dataset;
    add_camera(dataset, {0, 0, 0});
    add_camera(dataset, {0, 0, 1}, true);
    EXPECT_EQ(nearest_points(dataset), (std::vector<double>{0, 0})) << "no points";
    for (int i = 0; i < 300; ++i) add_point(dataset, {0, 0, 5 + 0.01 * i});
    for (int i = 0; i < 2; ++i) add_point(dataset, {0, 0, 0.1});
    const std::vector<double> nearest = nearest_points(dataset);
    EXPECT_NEAR(nearest[0], 5, 0.05);
    EXPECT_NEAR(nearest[1], 4, 0.05);
}

}  // namespace
}  // namespace darb
