// MotionControl: how much of a picture a frame in motion gets, in pixels and in splats, so that it
// takes a thirtieth of a second: of all choices that fit, by the measured time of the frames
// before, the one whose picture is nearest to the whole one. Hysteresis: what takes 0.7 to 1.0 of
// the target is kept even where another choice would be nearer, so that the picture comes to rest.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "engine/gpu/commands.h"

namespace darb {

/// 1 and 1: the picture at rest.
struct MotionQuality {
    double scale = 1;   // share of the width and of the height, in eighths, at least 1/4
    double splats = 1;  // share of the splats, merged (motion_levels.h)
    bool operator==(const MotionQuality&) const = default;
};

/// What a frame took, by what its cost goes with.
struct MotionCost {
    double fixed_ms = 0;   // panels, presentation
    double splats_ms = 0;  // projection, depth sort
    double pixels_ms = 0;  // blending, display
    double total_ms() const { return fixed_ms + splats_ms + pixels_ms; }
};

/// From the times of the passes: what lies between splats and pixels (splat-tile intersections)
/// counts half for either. frame_ms: the whole frame.
MotionCost motion_cost(double frame_ms, std::span<const PassTime> passes);

/// Mean squared error of a picture in motion against the whole one, as a multiple of that of half
/// the splats: 2.5 (1 / scale^2 - 1) + 1 / splats - 1. Measured, docs/experiments/merging.md.
double motion_error(const MotionQuality& quality);

/// What a picture in motion may have of a scene, shares of its splats from `most` down by square
/// roots of 2; 10,000 splats cost little, and no share is of fewer. most: below 1.
std::vector<double> motion_shares(std::size_t splats, double most);

class MotionControl {
  public:
    /// target_ms: of a whole frame in motion.
    explicit MotionControl(double target_ms = 1000.0 / 30) : target_ms_(target_ms) {}

    MotionQuality quality() const { return quality_; }
    /// A frame drawn at quality() took this. Two slow frames in a row lower the quality, a dozen
    /// quick ones raise it, by at most twice the splats and pixels or the next there is.
    void measured(const MotionCost& cost);
    /// Another scene, of which nothing is known. shares: those below 1 that can be drawn, falling.
    void start(std::vector<double> shares);

  private:
    void choose(double room_ms);
    double target_ms_;
    std::vector<double> shares_;
    MotionQuality quality_{0.5, 1};
    int slow_ = 0, quick_ = 0;  // frames in a row
    MotionCost best_;           // of the quickest of those
};

}  // namespace darb
