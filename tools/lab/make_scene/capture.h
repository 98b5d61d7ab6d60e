// SPDX-License-Identifier: MIT
// Cameras around the still life, the pictures that they take, and the points that they see.
#pragma once

#include <vector>

#include "engine/data/dataset.h"
#include "tools/lab/make_scene/world.h"

namespace darb::make_scene {

constexpr int kViews = 48;
constexpr int kTestEvery = 6;  // one view in 6 is held out: 8 of 48
constexpr int kTestOffset = 3;
constexpr int kOffPath = 16;
constexpr int kWidth = 200, kHeight = 150;  // px; size of the shipped photos
constexpr int kSamples = 64;                // per pixel of these; larger photos share them out
constexpr int kPoints = 4000;

constexpr double kPointReach =
    6;  // world units from 0; the floor of the still life fades out beyond

struct CaptureSettings {
    int points = kPoints;
    double reach = kPointReach;  // how far from 0 points are taken
    int samples = 0;             // per pixel; 0: kSamples shared out
};

/// Elevation of a path, degrees: in its middle, and how far it goes up and down.
struct Heights {
    double middle = 31, swing = 17;
};

/// A camera that looks from eye to target, with z up; scale multiplies the photo's sides.
Camera look_at(const glm::dvec3& eye, const glm::dvec3& target, double scale);

struct Capture {
    std::vector<ImageU8> photos;  // [views], RGB
    PointCloud points;
};

/// Three turns around the scene at changing heights; View::is_test marks the held-out views. scale
/// >= 1 multiplies the sides of the photos.
std::vector<View> camera_path(int scale = 1, const Heights& heights = {});

/// Views away from that path, all held out, whose pictures show what views along it hide: closer_N,
/// higher_N, lower_N (6 degrees), outside_N and between_N (between its turns), kOffPath in all.
std::vector<View> off_path_views(int scale = 1, const Heights& heights = {});

/// Takes their pictures (gamma 2.2, 8 bits); of a view whose lens is a panorama, one of all
/// directions. Uses all cores; the result does not depend on their
/// number.
std::vector<ImageU8> take_photos(const World& world, const std::vector<View>& views,
                                 std::uint64_t seed, int samples = 0);

/// Their true depths along the optical axis at the centres of the pixels, world units; 0 where the
/// ray meets nothing within `reach` world units of 0, as with a depth camera.
std::vector<ImageF> take_depths(const World& world, const std::vector<View>& views,
                                double reach = kPointReach);

/// Photos (gamma 2.2, 8 bits) and surface points, spread evenly over the pixels of the training
/// views, with 1 mm of noise. Uses all cores; the result does not depend on their number.
Capture capture_views(const World& world, const std::vector<View>& views,
                      const CaptureSettings& settings = {});

}  // namespace darb::make_scene
