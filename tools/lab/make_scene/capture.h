// Cameras around the still life, the pictures they take and the points that they see.
#pragma once

#include <vector>

#include "engine/data/dataset.h"
#include "tools/lab/make_scene/world.h"

namespace darb::make_scene {

constexpr int kViews = 48;
constexpr int kTestEvery = 6;  // of 6 views one is held out: 8 of 48
constexpr int kTestOffset = 3;
constexpr int kOffPath = 16;
constexpr int kWidth = 200, kHeight = 150;  // px, of the shipped photos
constexpr int kSamples = 64;                // per pixel of these; larger photos share them out
constexpr int kPoints = 4000;

constexpr double kPointReach =
    6;  // world units from 0; the floor of the still life fades out beyond

struct CaptureSettings {
    int points = kPoints;
    double reach = kPointReach;  // of points
    int samples = 0;             // per pixel; 0: kSamples shared out
};

/// Of a path, degrees: in the middle, and up and down from there.
struct Heights {
    double middle = 31, swing = 17;
};

/// From eye to target, z up; the photo's sides are scaled.
Camera look_at(const glm::dvec3& eye, const glm::dvec3& target, double scale);

struct Capture {
    std::vector<ImageU8> photos;  // [views], RGB
    PointCloud points;
};

/// Three turns around the scene at changing heights; View::is_test marks the held-out ones. scale
/// >= 1 multiplies the sides of the photos.
std::vector<View> camera_path(int scale = 1, const Heights& heights = {});

/// Views away from that path, all held out, whose pictures show what views along it hide:
/// closer_N, higher_N, lower_N (6 degrees), outside_N and between_N (its turns), kOffPath in all.
std::vector<View> off_path_views(int scale = 1, const Heights& heights = {});

/// Their pictures (gamma 2.2, 8 bits). Uses all cores; the result does not depend on their number.
std::vector<ImageU8> take_photos(const World& world, const std::vector<View>& views,
                                 std::uint64_t seed, int samples = 0);

/// Their true depths along the optical axis at the middles of the pixels, world units, 0 where the
/// ray meets nothing within the reach of points, as of a depth camera.
std::vector<ImageF> take_depths(const World& world, const std::vector<View>& views);

/// Photos (gamma 2.2, 8 bits) and so many surface points, evenly spread over the pixels of the
/// training views, with 1 mm of noise. Uses all cores; the result does not depend on their number.
Capture capture_views(const World& world, const std::vector<View>& views,
                      const CaptureSettings& settings = {});

}  // namespace darb::make_scene
