// Masks of photos that colmap straightened: it leaves them behind.
#pragma once

#include <cstddef>
#include <filesystem>

#include "engine/data/run_colmap.h"

namespace darb {

/// Straightens the masks beside run.photos, as add_masks finds them, by the lenses of the model
/// that colmap found in run.workspace/sparse and the pinholes of run.workspace/dense, as
/// image_undistorter straightened the photos. They go to run.workspace/dense/masks, 8-bit grey of
/// each photo's name and ".png", where load_dataset of run.workspace/dense finds them: bilinear,
/// and 0 where the lens sees nothing. The folder appears when all are written. Does nothing where
/// it is there. Returns how many photos have one. Throws Error naming the file.
std::size_t straighten_masks(const ColmapRun& run);

}  // namespace darb
