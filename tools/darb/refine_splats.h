// A scene that was merged, trained on for a little while.
#pragma once

#include <filesystem>

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// Photos to train on, and those held out to measure with.
class Refiner {
  public:
    /// Loads the data set with its photos; sources without a split of their own hold out every 8th.
    Refiner(const std::filesystem::path& dataset, const DatasetOptions& options);

    /// The splats after so many iterations on the photos: none are added or removed, rates are
    /// those of the end of a long run, kernel, footprint, degree and antialias stay.
    SplatModel refine(Device& device, const SplatModel& model, int iterations) const;
    /// Mean over the held-out photos, dB.
    double psnr_db(Device& device, const SplatModel& model) const;
    const Dataset& dataset() const { return dataset_; }

  private:
    Dataset dataset_;
    std::vector<ImageU8> photos_;
};

}  // namespace darb
