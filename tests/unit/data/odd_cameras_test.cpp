// SPDX-License-Identifier: MIT
// Notes on cameras that cannot be right.
#include <gtest/gtest.h>

#include <cmath>

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

/// Twelve cameras on a ring of radius 3 that look at its middle, and points within 1 of it.
Dataset ring(const glm::dvec3& middle = {0, 0, 0}, char first = 'a') {
    Dataset dataset;
    for (int i = 0; i < 12; ++i) {
        const double angle = i * 0.5235987755982988;
        View view;
        view.name = std::string(1, static_cast<char>(first + i)) + ".png";
        view.lens = {"PINHOLE", {70, 70, 40, 30}, 80, 60};
        view.camera.rotation = glm::dmat3(1.0);
        const glm::dvec3 forward(-std::cos(angle), 0, -std::sin(angle));
        const glm::dvec3 right(std::sin(angle), 0, -std::cos(angle));
        view.camera.rotation =
            glm::transpose(glm::dmat3(right, glm::cross(forward, right), forward));
        view.camera.translation = -(view.camera.rotation * (middle - 3.0 * forward));
        dataset.views.push_back(view);
    }
    for (int i = 0; i < 200; ++i)
        for (int c = 0; c < 3; ++c)
            dataset.points.position.push_back(middle[c] + std::sin(i * (c + 1.7)));
    dataset.points.colour.assign(600, 0);
    return dataset;
}

void scale_position(View& view, double factor) {
    view.camera.translation *= factor;
}

std::string left_out(Dataset dataset) {
    Dataset before = dataset;
    leave_out_far_cameras(dataset);
    std::string names;
    std::size_t at = 0;
    for (const View& view : before.views) {
        const bool stays = at < dataset.views.size() && dataset.views[at].name == view.name;
        at += stays ? 1 : 0;
        if (!stays) names += view.name.substr(0, 1);
    }
    EXPECT_EQ(dataset.notes.size(), names.empty() ? 0u : 1u);
    for (const char name : names)
        EXPECT_NE(dataset.notes.at(0).find(std::string(1, name) + ".png"), std::string::npos);
    return names;
}

TEST(FarCameras, are_left_out_and_named_with_points_and_without) {
    for (const bool points : {true, false}) {
        Dataset dataset = ring();
        if (!points) dataset.points = {};
        EXPECT_EQ(left_out(dataset), "");
        scale_position(dataset.views[3], 1000);
        EXPECT_EQ(left_out(dataset), "d") << points;
        scale_position(dataset.views[0], 1000);
        scale_position(dataset.views[7], -20000);
        EXPECT_EQ(left_out(dataset), "adh") << points;
        const double extent = scene_extent(ring());
        leave_out_far_cameras(dataset);
        EXPECT_NEAR(scene_extent(dataset), extent, 0.4 * extent);
    }
    Dataset dataset = ring();
    for (const int i : {1, 2, 9}) dataset.views[i].camera.translation = {1e7, 1e7, 1e7};
    EXPECT_EQ(left_out(dataset), "bcj") << "one false position for all";
    dataset = ring();
    scale_position(dataset.views[3], 30);
    EXPECT_EQ(left_out(dataset), "d") << "the points take up 3 % of its frame";
    dataset.options.require_photos = false;
    leave_out_far_cameras(dataset);
    EXPECT_EQ(dataset.views.size(), 12u) << "a list of cameras stays whole";
    EXPECT_EQ(dataset.notes.size(), 1u);
}

TEST(FarCameras, are_not_those_of_a_second_place_or_of_an_overview) {
    const auto joined = [](Dataset a, const Dataset& b) {
        a.views.insert(a.views.end(), b.views.begin(), b.views.end());
        for (const double x : b.points.position) a.points.position.push_back(x);
        a.points.colour.resize(a.points.position.size());
        return a;
    };
    for (const bool points : {true, false})
        for (const std::size_t of_second : {3u, 5u, 12u}) {
            Dataset second = ring({4000, 0, 0}, 'm');
            second.views.resize(of_second);
            Dataset rooms = joined(ring(), second);
            if (!points) rooms.points = {};
            EXPECT_EQ(left_out(rooms), "") << "two rooms " << points << of_second;
            rooms.points = ring().points;
            EXPECT_EQ(left_out(rooms), "") << "two rooms, points of one " << of_second;
        }
    Dataset drone = ring();
    for (const int i : {0, 5, 8}) scale_position(drone.views[i], 40);
    for (int i = 0; i < 400; ++i)  // what only the drone sees
        for (const double value : {60 * std::sin(i * 1.3), 0.0, 60 * std::sin(i * 2.1)})
            drone.points.position.push_back(value);
    drone.points.colour.resize(drone.points.position.size());
    EXPECT_EQ(left_out(drone), "") << "a drone and the ground";
    Dataset tele = ring();
    scale_position(tele.views[2], 40);
    tele.views[2].lens.parameters = {70 * 30, 70 * 30, 40, 30};
    EXPECT_EQ(left_out(tele), "") << "a long lens";
    Dataset row;
    row = ring();
    for (int i = 0; i < 12; ++i) row.views[i].camera.translation = {std::pow(2.0, i), 0, 0};
    row.points = {};
    EXPECT_EQ(left_out(row), "") << "cameras along a road";
    Dataset one_place = ring();
    for (View& view : one_place.views) view.camera.translation = {0, 0, 0};
    one_place.views[4].camera.translation = {0.1, 0, 0};
    EXPECT_EQ(left_out(one_place), "") << "a tripod that was moved";
    one_place.points = {};
    EXPECT_EQ(left_out(one_place), "") << "a tripod that was moved, no points";
}

}  // namespace
}  // namespace darb
