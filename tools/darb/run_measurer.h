// What `darb compare` measures on each of its runs, beside what training did: LPIPS, pictures at
// other sizes and off the path, and blending.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "tools/darb/compare_flags.h"
#include "tools/darb/scene_evaluation.h"
#include "tools/paper/compare_measure.h"

namespace darb {

/// A run's failure, unless it was interrupted, and its notes, for people; -q hides the notes.
void say_what_went_wrong(const ComparedRun& run);

/// Of one data set.
class RunMeasurer {
  public:
    /// path: of the data set. Throws Error where a photo is too small for one of flags.scales.
    /// lpips may be null.
    RunMeasurer(const CompareFlags& flags, const std::filesystem::path& path,
                const Dataset& dataset, const TrainRequest& first, const Lpips* lpips);

    // Of runs that came to their end. What fails here becomes a note and leaves the run as it is.

    /// All but blending.
    void measure(ComparedRun& run);
    /// Of each kernel's first run that came to its end: on one device, as times are compared.
    void measure_blending(std::vector<ComparedRun>& runs, const std::vector<View>& held_out) const;
    /// What is measured, in words: ranks that differ in it would give numbers to some runs alone.
    std::string measurements() const;

  private:
    void on_device(ComparedRun& run, const char* what,
                   const std::function<void(Device&)>& measurement) const;
    void measure_models(ComparedRun& run, Device& device) const;

    const CompareFlags& flags_;
    ViewLpips lpips_;
    std::vector<std::vector<View>> scaled_;  // [scale]
    SceneEvaluation options_;
    Dataset off_path_;
    std::string lpips_name_;
};

}  // namespace darb
