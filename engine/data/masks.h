// SPDX-License-Identifier: MIT
// Masks beside the photos, by the names that COLMAP, RealityCapture and people give them.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "engine/data/dataset.h"
#include "engine/data/run_colmap.h"

namespace darb {

/// FOLDER/masks or, where that holds no pictures, FOLDER/mask, ignoring case; empty where neither
/// holds any.
std::filesystem::path masks_folder(const std::filesystem::path& folder);

/// Gives every view its mask from masks_folder(folder), with a note where some have none. A mask
/// has the photo's name, with or without a leading "images/", with a picture extension in place of
/// the photo's or added to it, and possibly ".mask" before that; failing that, it is the only file
/// whose name matches the photo's apart from case, missing folders, a second extension and "mask".
/// Where there is no such folder, NAME_mask.png and the like beside the photos are taken. Where
/// these do not exist either, a note names folders that may have been meant. Throws Error where the
/// folder holds no mask for any view and photos are required.
void add_masks(const std::filesystem::path& folder, const DatasetOptions& options,
               Dataset& dataset);

// Masks of photos that COLMAP has undistorted, because COLMAP does not take masks along.

/// Undistorts the masks beside run.photos, as add_masks finds them, from the lenses of the model in
/// run.workspace/sparse to the pinholes of run.workspace/dense, as image_undistorter did with the
/// photos. They are written to run.workspace/dense/masks, where load_dataset of run.workspace/dense
/// finds them, as 8-bit grey PNG with each photo's name and ".png": sampled bilinearly, and 0 where
/// the lens sees nothing. The folder appears only when all are written. Does nothing where it
/// exists. Returns how many photos have a mask. Throws Error naming the file.
std::size_t straighten_masks(const ColmapRun& run);

}  // namespace darb
