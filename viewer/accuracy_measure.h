// AccuracyMeasure: what each choice of each accuracy setting and effect costs and changes, at the
// camera; one picture a call so that a window stays alive.
#pragma once

#include <functional>
#include <vector>

#include "engine/core/image.h"
#include "viewer/session.h"

namespace darb {

class AccuracyMeasure {
  public:
    struct Frame {
        ImageU8 picture;
        double ms = 0;
    };
    /// camera: of all pictures, whose size is therefore the same. display: as it is now; each
    /// choice is put in its place alone. own: as the scene is meant to be shown; with the exact
    /// preset, what the error is against.
    AccuracyMeasure(const Camera& camera, const DisplaySettings& display,
                    const DisplaySettings& own);

    bool done() const { return next_ >= pictures_.size(); }
    double share() const { return double(next_) / double(pictures_.size()); }
    void step(const std::function<Frame(const Camera&, const DisplaySettings&)>& render);
    const std::vector<MeasuredChoice>& results() const { return results_; }

  private:
    /// Choices that give the same picture, as all that are chosen now do.
    struct Picture {
        DisplaySettings display;
        std::vector<MeasuredChoice> choices;
    };
    Camera camera_;
    std::vector<Picture> pictures_;  // the exact one first, then as it is now
    std::vector<MeasuredChoice> results_;
    size_t next_ = 0;
    ImageF exact_;
};

}  // namespace darb
