// ResolutionControl: how much of the full resolution a frame gets. While something moves, as much
// as the frame time allows; at rest, all of it.
#pragma once

#include <array>

namespace darb {

class ResolutionControl {
  public:
    /// target_ms: of a whole frame in motion.
    explicit ResolutionControl(double target_ms = 1000.0 / 30) : target_ms_(target_ms) {}

    /// Share of the window's width and height that a frame in motion gets: 1/8 to 1 in eighths.
    double moving_scale() const { return double(step_) / kSteps; }

    /// A frame in motion at moving_scale() took `ms`. One eighth up where there is time, one down
    /// where there is not and it helps: much of a frame's cost goes with the splats, not with the
    /// pixels, and pixels that cost nothing are not given away.
    void measured(double ms);

  private:
    static constexpr int kSteps = 8;
    struct Known {
        double ms = 0;
        int at = -1'000;  // number of the measurement; old ones are forgotten
    };
    bool known(int step) const;

    double target_ms_;
    int step_ = kSteps / 2;
    int count_ = 0;
    std::array<Known, kSteps + 2> known_{};
};

}  // namespace darb
