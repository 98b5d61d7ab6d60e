// Masks that lie beside the photos, by the names that COLMAP, RealityCapture and people give them.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "engine/data/dataset.h"
#include "engine/data/run_colmap.h"

namespace darb {

/// FOLDER/masks or, where it holds no pictures, FOLDER/mask, in whatever case; empty where neither
/// does.
std::filesystem::path masks_folder(const std::filesystem::path& folder);

/// Gives every view its mask in masks_folder(folder), with a note where some have none: of the
/// photo's name, a leading "images/" left out or not, with the extension of a picture in place of
/// the photo's or added to it, after ".mask" or not; else the one file whose name is the photo's
/// but for case, folders that one of them lacks, a second extension and "mask". Where there is no
/// such folder, NAME_mask.png and the like beside the photos. Where neither is, a note names
/// folders that may have been meant. Throws Error where a folder has none of a view and photos are
/// asked for.
void add_masks(const std::filesystem::path& folder, const DatasetOptions& options,
               Dataset& dataset);

// Masks of photos that colmap straightened: it leaves them behind.

/// Straightens the masks beside run.photos, as add_masks finds them, by the lenses of the model
/// that colmap found in run.workspace/sparse and the pinholes of run.workspace/dense, as
/// image_undistorter straightened the photos. They go to run.workspace/dense/masks, 8-bit grey of
/// each photo's name and ".png", where load_dataset of run.workspace/dense finds them: bilinear,
/// and 0 where the lens sees nothing. The folder appears when all are written. Does nothing where
/// it is there. Returns how many photos have one. Throws Error naming the file.
std::size_t straighten_masks(const ColmapRun& run);

}  // namespace darb
