// What `darb compare` measures on each of its runs, beside what training did: LPIPS, pictures at
// other sizes and off the path, and blending.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "tools/darb/compare_flags.h"
#include "tools/darb/scene_evaluation.h"
#include "tools/paper/compare_measure.h"

namespace darb {

/// A run's failure and its notes, for people; -q hides the notes.
void say_what_went_wrong(const ComparedRun& run);

/// Of one data set.
class RunMeasurer {
  public:
    /// path: of the data set. Throws Error where a photo is too small for one of flags.scales.
    /// lpips may be null.
    RunMeasurer(const CompareFlags& flags, const std::filesystem::path& path,
                const Dataset& dataset, const TrainFlags& first, const Lpips* lpips);

    /// Of a run that came to its end; blending of the first of a kernel. held_out: as its effects
    /// have them. What fails here becomes a note and leaves the run as it is.
    void measure(ComparedRun& run, const std::vector<View>& held_out);

  private:
    void measure_models(ComparedRun& run, Device& device) const;

    const CompareFlags& flags_;
    ViewLpips lpips_;
    std::vector<std::vector<View>> scaled_;  // [scale]
    SceneEvaluation options_;
    Dataset off_path_;
    std::set<std::string> blended_;  // kernels
};

}  // namespace darb
