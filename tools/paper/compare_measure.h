// SPDX-License-Identifier: MIT
// What a comparison measures on finished runs: LPIPS of held-out pictures, and blending.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "engine/gpu/device.h"
#include "tools/paper/compare_runs.h"
#include "tools/paper/lpips.h"

namespace darb {

/// LPIPS for one data set. Keeps the features of its photos as far as they fit into `room` bytes;
/// for a photo of 1.6 million px, they take 0.8 GB with VGG16.
class ViewLpips {
  public:
    explicit ViewLpips(const Lpips* lpips, std::size_t room = std::size_t{1} << 29)
        : lpips_(lpips), room_(room) {}  // lpips null: measures nothing
    /// Fills lpips of every view with a picture on disk, and the mean where every view has one.
    void measure(ComparedRun& run);

    std::size_t photos_kept() const { return photos_.size(); }

  private:
    double distance(const ComparedView& view, const HeldOutPicture& picture);

    const Lpips* lpips_;
    std::size_t room_;                             // bytes left
    std::map<std::string, LpipsFeatures> photos_;  // by view
};

/// Sets run.exit_code as main would for the exception: 2 for what the user can mend, else 1; a 1
/// stays.
void count_exception(const std::exception& e, ComparedRun& run);

/// Runs the measurement; an exception becomes a note that names it, and the run stays as it is.
void attempt(ComparedRun& run, const std::string& what, const std::function<void()>& measurement);

/// Sets run.blending from the last saved model, over at most `views` of the cameras.
void measure_blending_of(ComparedRun& run, Device& device, std::vector<Camera> cameras, int views);

}  // namespace darb
