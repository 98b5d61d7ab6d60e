// darb train VIDEO: the pictures of a video as the photos of a run.
#pragma once

#include <filesystem>
#include <optional>

#include "tools/darb/train_flags.h"
#include "trainer/run_folder.h"

namespace darb {

/// OUT/frames with the sharpest picture of each interval of the video, made where it is not there
/// from the same video; flags.sequential is set, as pictures that follow each other match best.
/// lock: that of OUT, taken before anything is written. Throws Error where ffmpeg or colmap is
/// missing, before that.
std::filesystem::path photos_of_video(const std::filesystem::path& video, TrainFlags& flags,
                                      std::optional<RunLock>& lock);

}  // namespace darb
