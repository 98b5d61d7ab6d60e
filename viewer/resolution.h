// ResolutionControl: how much of the full resolution a frame gets. While something moves, as much
// as the frame time allows; at rest, all of it.
#pragma once

namespace darb {

class ResolutionControl {
  public:
    /// target_ms: of a whole frame in motion.
    explicit ResolutionControl(double target_ms = 1000.0 / 30) : target_ms_(target_ms) {}

    /// Share of the window's width and height that a frame in motion gets: [1/8, 1] in steps of
    /// 1/32.
    double moving_scale() const;
    /// A frame in motion of `scale` took `ms`. Cost is taken as proportional to pixels, and the
    /// step is bounded, so that one slow frame does not blur the next ten.
    void measured(double scale, double ms);

  private:
    double target_ms_;
    double scale_ = 0.5;
};

}  // namespace darb
