#include "viewer/motion.h"

#include <algorithm>
#include <cmath>

namespace darb {

namespace {

constexpr int kSlowFrames = 2, kQuickFrames = 12;
constexpr double kAim = 0.85, kRoom = 0.7;  // of the target: what a change aims at; room for more
constexpr double kMostDown = 0.2, kMostUp = 2;  // factor of one change
constexpr double kLeastPixels = 1.0 / 16, kLeastSplats = 10'000;

}  // namespace

MotionCost motion_cost(double frame_ms, std::span<const PassTime> passes) {
    MotionCost cost;
    for (const PassTime& pass : passes) {
        const bool of_splats =
            pass.name == "project" || pass.name == "compact" || pass.name == "depth sort";
        const bool of_pixels = pass.name == "blend" || pass.name == "display";
        const double share = of_splats ? 1 : of_pixels ? 0 : 0.5;
        cost.splats_ms += share * pass.ms;
        cost.pixels_ms += (1 - share) * pass.ms;
    }
    cost.fixed_ms = std::max(0.0, frame_ms - cost.splats_ms - cost.pixels_ms);
    return cost;
}

MotionQuality MotionControl::quality() const {
    return {std::ceil(std::sqrt(pixels_) * 8 - 1e-9) / 8, splats_};
}

void MotionControl::start(std::size_t splats, double most) {
    *this = MotionControl(target_ms_);
    most_ = most;
    least_ = std::min(kLeastSplats / std::max(static_cast<double>(splats), 1.0), most);
    splats_ = std::clamp(splats_, least_, most_);
}

// `factor` for what costs more, less of a change for the other; up, where one is whole, all for the
// other. Between most_ and all splats there is nothing: a step, taken where they fit.
void MotionControl::change(double factor, double room_ms) {
    const bool at_most = factor > 1 && splats_ < 1 && splats_ >= most_;
    if (at_most && best_.splats_ms / splats_ + best_.pixels_ms <= room_ms) {
        splats_ = 1;
        return;
    }
    const double most = std::max({best_.splats_ms, best_.pixels_ms, 1e-9});
    const bool up = factor > 1;
    const double of_splats = up && pixels_ >= 1 ? 1 : best_.splats_ms / most;
    const double of_pixels = up && (splats_ >= 1 || at_most) ? 1 : best_.pixels_ms / most;
    splats_ = std::clamp(splats_ * std::pow(factor, of_splats), least_, 1.0);
    if (splats_ < 1) splats_ = std::min(splats_, most_);
    pixels_ = std::clamp(pixels_ * std::pow(factor, of_pixels), kLeastPixels, 1.0);
}

void MotionControl::measured(const MotionCost& cost) {
    const double ms = cost.total_ms();
    if (!(ms > 0)) return;
    const bool slow = ms > target_ms_, quick = ms < kRoom * target_ms_;
    const bool first = slow ? slow_ == 0 : quick_ == 0;
    slow_ = slow ? slow_ + 1 : 0;
    quick_ = quick ? quick_ + 1 : 0;
    if (first || ms < best_.total_ms()) best_ = cost;
    if (slow_ < kSlowFrames && quick_ < kQuickFrames) return;
    slow_ = quick_ = 0;
    // Where panels and presentation leave nothing, a fifth of the time all the same.
    const double room_ms = std::max(kAim * target_ms_ - best_.fixed_ms, 0.2 * target_ms_);
    const double factor = room_ms / std::max(best_.splats_ms + best_.pixels_ms, 1e-6);
    if (slow == (factor < 1)) change(std::clamp(factor, kMostDown, kMostUp), room_ms);
}

}  // namespace darb
