// Notes on cameras that cannot be right.
#include <gtest/gtest.h>

#include "engine/data/source.h"

namespace darb {
namespace {

Dataset good() {
    Dataset dataset;
    for (const char* name : {"a.png", "b.png"}) {
        dataset.views.emplace_back();
        dataset.views.back().name = name;
        dataset.views.back().camera = {
            .width = 80, .height = 60, .fx = 70, .fy = 71, .cx = 40, .cy = 30};
    }
    for (int i = 0; i < 100; ++i)
        for (const double value : {0.01 * i, 0.1, i % 2 == 0 ? -5.0 : 5.0})
            dataset.points.position.push_back(value);
    dataset.points.colour.assign(300, 0);
    return dataset;
}

std::string note_on(Dataset dataset) {
    note_odd_cameras(dataset);
    EXPECT_LE(dataset.notes.size(), 1u);
    return dataset.notes.empty() ? "" : dataset.notes[0];
}

TEST(OddCameras, good_ones_are_not_mentioned) {
    EXPECT_EQ(note_on(good()), "");
    Dataset without_points = good();
    without_points.points = {};
    EXPECT_EQ(note_on(without_points), "");
}

TEST(OddCameras, that_see_no_point_are_counted) {
    Dataset dataset = good();
    dataset.views[1].camera.translation = {0, 0, -100};
    EXPECT_EQ(note_on(dataset),
              "Warning: none of the points is in view: 1 camera of 2, as b.png. Points and cameras "
              "may be of different reconstructions.");
    dataset.views[1].camera.translation = {500, 0, 0};
    EXPECT_NE(note_on(dataset), "");
    dataset.points.position.resize(3 * 99);
    dataset.points.colour.resize(3 * 99);
    EXPECT_EQ(note_on(dataset), "") << "few points say nothing";
}

TEST(OddCameras, focal_lengths_and_principal_points_beyond_reason_are_named) {
    Dataset dataset = good();
    dataset.views[0].camera.fx = dataset.views[0].camera.fy = 1e6;
    dataset.points = {};
    EXPECT_EQ(
        note_on(dataset),
        "Warning: focal lengths beyond reason: 1 camera, as a.png with 1e+06 and 1e+06 px for "
        "80 x 60 px.");
    dataset.views[0].camera.fx = dataset.views[0].camera.fy = 0.5;
    EXPECT_NE(note_on(dataset), "");
    dataset = good();
    dataset.views[1].camera.cx = 4000;
    dataset.points = {};
    EXPECT_EQ(
        note_on(dataset),
        "Warning: principal points far outside of the photo: 1 camera, as b.png with 4000, 30 "
        "for 80 x 60 px.");
}

}  // namespace
}  // namespace darb
