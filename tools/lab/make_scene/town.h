// A generated town for runs in blocks: a square of streets, houses and trees, far larger than what
// one camera sees, and the flight over it.
#pragma once

#include <vector>

#include "engine/data/dataset.h"
#include "tools/lab/make_scene/capture.h"
#include "tools/lab/make_scene/world.h"

namespace darb::make_scene {

constexpr int kTownBlocks = 4;         // a side: 16 blocks of houses
constexpr double kTownBlockSide = 5;   // world units, street included
constexpr int kTownTestEvery = 8;      // of so many views one is held out
constexpr int kTownPointsAPhoto = 60;  // surface points for each photo

World town();

/// `side` x `side` views at two heights, obliquely down in four headings by turns; scale multiplies
/// the photos' sides of 200 x 150 px.
std::vector<View> town_flight(int side, double scale);

/// What photos and points of the town are taken with.
CaptureSettings town_capture(std::size_t views);

}  // namespace darb::make_scene
