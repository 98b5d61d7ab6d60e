// SPDX-License-Identifier: MIT
// A generated town for training in blocks: a square of streets, houses and trees, far larger than
// what one camera sees, and a flight over it.
#pragma once

#include <vector>

#include "engine/data/dataset.h"
#include "tools/lab/make_scene/capture.h"
#include "tools/lab/make_scene/world.h"

namespace darb::make_scene {

constexpr int kTownBlocks = 4;         // per side: 16 blocks of houses
constexpr double kTownBlockSide = 5;   // world units, street included
constexpr int kTownTestEvery = 8;      // one view in this many is held out
constexpr int kTownPointsAPhoto = 60;  // surface points per photo

World town();

/// `side` x `side` views at two heights, looking obliquely down in four headings in turn. scale
/// multiplies the sides of the photos, 200 x 150 px.
std::vector<View> town_flight(int side, double scale);

/// Panoramas of a walk along two streets, and around the corner between them, at the height of a
/// head. width: of a panorama, px.
std::vector<View> town_walk(int count, int width);

/// How photos and points of the town are captured.
CaptureSettings town_capture(std::size_t views);

}  // namespace darb::make_scene
