#include "viewer/motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace darb {

namespace {

constexpr int kSlowFrames = 2, kQuickFrames = 12;
constexpr double kAim = 0.85, kRoom = 0.7;   // of the target: what a change aims at; room for more
constexpr double kMostUp = 2;                // factor of one change
constexpr double kPixelsWeight = 2.5;        // in the error
constexpr int kScales = 8, kLeastScale = 2;  // eighths
constexpr double kLeastSplats = 10'000;

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

double motion_error(const MotionQuality& q) {
    return kPixelsWeight * (1 / (q.scale * q.scale) - 1) + 1 / q.splats - 1;
}

std::vector<double> motion_shares(std::size_t splats, double most) {
    std::vector<double> shares;
    const double least = (1 - 1e-9) * kLeastSplats / std::max(static_cast<double>(splats), 1.0);
    for (double share = most; share > 0 && (shares.empty() || share >= least);
         share /= std::numbers::sqrt2)
        shares.push_back(share);
    return shares;
}

void MotionControl::start(std::vector<double> shares) {
    *this = MotionControl(target_ms_);
    shares_ = std::move(shares);
    for (const double share : shares_)
        if (share >= 0.2) quality_.splats = share;  // about a quarter, or the nearest there is
    if (quality_.splats == 1 && !shares_.empty()) quality_.splats = shares_.front();
}

// From the time of the best of the last frames; where nothing fits, what takes least.
void MotionControl::choose(double room_ms) {
    const double splats_ms = best_.splats_ms / quality_.splats;
    const double pixels_ms = best_.pixels_ms / (quality_.scale * quality_.scale);
    std::vector<double> shares = {1};
    shares.insert(shares.end(), shares_.begin(), shares_.end());
    double largest = kMostUp * quality_.splats;  // the next share, where that is farther off
    for (const double share : shares)
        if (share > quality_.splats) largest = std::max(kMostUp * quality_.splats, share);
    const MotionQuality now = quality_;
    double best_error = 0, least_ms = 0;
    bool any_fits = false, first = true;
    for (const double share : shares)
        for (int eighths = kLeastScale; eighths <= kScales; ++eighths) {
            const MotionQuality q{static_cast<double>(eighths) / kScales, share};
            const double ms = splats_ms * q.splats + pixels_ms * q.scale * q.scale;
            if (share > largest || q.scale > kMostUp * now.scale) continue;
            const bool fits = ms <= room_ms;
            const double error = motion_error(q);
            if (fits ? !any_fits || error < best_error : !any_fits && (first || ms < least_ms)) {
                quality_ = q;
                best_error = error;
            }
            least_ms = first ? ms : std::min(least_ms, ms);
            any_fits |= fits;
            first = false;
        }
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
    const bool fits = best_.splats_ms + best_.pixels_ms <= room_ms;
    if (slow != fits) choose(room_ms);
}

}  // namespace darb
