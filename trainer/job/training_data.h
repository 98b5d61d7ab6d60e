// SPDX-License-Identifier: MIT
// What a request trains on: a data set, photos whose cameras COLMAP finds first, or a video whose
// sharpest pictures ffmpeg takes before that.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "engine/data/dataset.h"
#include "engine/data/run_colmap.h"
#include "trainer/job/request.h"
#include "trainer/run/run_folder.h"

namespace darb {

/// Who hears of what COLMAP and ffmpeg do.
struct DataSinks {
    bool quiet = false;                               // nothing on the terminal
    const std::atomic<bool>* stop = nullptr;          // set by others: COLMAP is ended
    std::function<void(std::string_view)> said = {};  // each line of progress; may be empty
};

/// Throws Error where there are several ranks and the data set is a video, or photos without
/// cameras, which one rank is to make first.
void refuse_without_cameras(const TrainRequest& request, int ranks);

/// Loads request.dataset, every view of it to train on unless request.data.hold_out. A folder of
/// PNG and JPEG files (itself, or its --images folder) without sparse, sparse/0 or transforms*.json
/// goes through the installed COLMAP into OUT/colmap first; what is there from an earlier run over
/// the same photos is used again. Throws Error as load_dataset and run_colmap do, and where OUT
/// lies among the photos. A video becomes photos in OUT/frames first,
/// which needs ffmpeg. lock: that of OUT,
/// taken before anything is written there. sinks.stop ends COLMAP, with ColmapStopped,
/// and the same request goes on from there.
Dataset load_training_data(TrainRequest& request, std::optional<RunLock>& lock,
                           const DataSinks& sinks = {});

/// "[2/4] matching: 120 of 300 pairs, 12 s, about 20 s left". step: from 1.
std::string colmap_progress_text(std::size_t step, const ColmapOutput& output, double seconds,
                                 double left);

}  // namespace darb
