// What a live view of training draws beside the picture: curves of the run, bounds of its scene.
#pragma once

#include "engine/data/dataset.h"
#include "trainer/run/run.h"
#include "viewer/bounds.h"
#include "viewer/session.h"

namespace darb {

struct LiveCurves {
    /// One step; thins the curves out as they get long.
    void add(const LiveStep& step, TrainingCurves& curves);

    float loss = 0, psnr_db = 0;  // smoothed
    int stride = 1;               // iterations of one value of a curve
};

/// What the cameras look at of the sparse points; the cameras where there are none.
Bounds bounds_of(const Dataset& dataset);

}  // namespace darb
