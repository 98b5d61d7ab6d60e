// What `darb train` trains on: a data set, or photos whose cameras COLMAP finds first.
#pragma once

#include <optional>

#include "engine/data/dataset.h"
#include "tools/darb/train_flags.h"
#include "trainer/run_folder.h"

namespace darb {

/// Throws Error where there are several ranks and the data set is a video, or photos without
/// cameras, which one rank is to make first.
void refuse_without_cameras(const TrainFlags& flags, int ranks);

/// Loads flags.dataset, every view of it to train on unless flags.data.hold_out. A folder of PNG
/// and JPEG files (itself, or its --images folder) without sparse, sparse/0 or transforms*.json
/// goes through the installed COLMAP into OUT/colmap first; what is there from an earlier run over
/// the same photos is used again. Throws Error as load_dataset and run_colmap do, and where OUT
/// lies among the photos. A video becomes photos first, see video_photos.h. lock: that of OUT,
/// taken before anything is written there.
Dataset load_training_data(TrainFlags& flags, std::optional<RunLock>& lock);

}  // namespace darb
