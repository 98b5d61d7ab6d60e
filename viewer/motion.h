// MotionControl: how much of a picture a frame in motion gets, in pixels and in splats, so that it
// takes a thirtieth of a second. Decided by the measured time of the frames before.
#pragma once

#include <cstddef>
#include <span>

#include "engine/gpu/commands.h"

namespace darb {

/// 1 and 1: the picture at rest.
struct MotionQuality {
    double scale = 1;   // share of the width and of the height, in eighths, at least 1/4
    double splats = 1;  // share of the splats, the most important ones first
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

class MotionControl {
  public:
    /// target_ms: of a whole frame in motion.
    explicit MotionControl(double target_ms = 1000.0 / 30) : target_ms_(target_ms) {}

    MotionQuality quality() const;
    /// A frame drawn at quality() took this. Two slow frames in a row lower the quality, a dozen
    /// quick ones raise it; whichever of splats and pixels costs more changes more. From the
    /// largest share below all the next is all splats, where there is time for them.
    void measured(const MotionCost& cost);
    /// Another scene, of which nothing is known but how many splats it has and the largest share of
    /// them below all. 10,000 splats cost little and are always drawn.
    void start(std::size_t splats, double most);

  private:
    void change(double factor, double room_ms);
    double target_ms_;
    double most_ = 0.5, least_ = 1.0 / 64;  // shares of the splats; most_ below all
    double pixels_ = 0.25, splats_ = 0.25;  // shares
    int slow_ = 0, quick_ = 0;              // frames in a row
    MotionCost best_;                       // of the quickest of those
};

}  // namespace darb
