// What a comparison measures on finished runs: LPIPS of held-out pictures, and blending.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "engine/gpu/device.h"
#include "tools/paper/compare.h"
#include "tools/paper/lpips.h"

namespace darb {

/// Of one data set: keeps the features of its photos.
class ViewLpips {
  public:
    explicit ViewLpips(const Lpips* lpips) : lpips_(lpips) {}  // null: measures nothing
    /// Fills lpips of every view with a picture on disk, and the mean where every view has one.
    void measure(ComparedRun& run);

  private:
    const Lpips* lpips_;
    std::map<std::string, LpipsFeatures> photos_;  // by view
};

/// run.blending, of the last saved model, over at most `views` of the cameras.
void measure_blending_of(ComparedRun& run, Device& device, std::vector<Camera> cameras, int views);

}  // namespace darb
