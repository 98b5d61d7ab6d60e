// Depths that were measured beside the photos (LiDAR, depth cameras): where they lie, and as the
// cameras of the views see them.
#pragma once

#include <filesystem>

#include "engine/core/image.h"
#include "engine/data/dataset.h"

namespace darb {

/// Gives every view its depth in FOLDER/depths or, where that is not there, FOLDER/depth, in
/// whatever case: the photo's name, a leading "images/" left out or not, with .png, .tif, .tiff or
/// .npy in place of its extension or added to it, after "_depth" or not. Without such a folder,
/// those of NAME_depth beside the photos. Photos may have none. Files of another kind, and folders
/// that may have been meant, are noted. images: the folder of the photos. Throws Error where a file
/// there is of no photo. Where FOLDER/sparse/0/depth_params.json lies they are inverse depths of a
/// network, which 3DGS takes: a note says that they are left out.
void add_depths(const std::filesystem::path& folder, const std::filesystem::path& images,
                const DatasetOptions& options, Dataset& dataset);

/// The depth of a view, [H][W] of its camera, metres along the optical axis, 0 where nothing was
/// measured; the file may have any size of the photo's shape. Straightened with the photo. Between
/// four measured neighbours that are within 5 % bilinear, elsewhere the measured one that is
/// nearest within the pixel. Throws Error naming the file.
ImageF load_depth(const View& view);

/// World units a metre: DatasetOptions::depth_scale; else, where tracks say which photos see which
/// points, the median of the points' depths over the measured ones, with a note; else what the
/// reader of the source set, 1 but for transforms files with an applied_scale. Throws Error where
/// fewer than 20 points were measured. Views must be fitted (fit_views).
void find_depth_scale(Dataset& dataset);

}  // namespace darb
