// SPDX-License-Identifier: MIT
// Depths that were measured along with the photos (by LiDAR or depth cameras): finding the files,
// and mapping them to the cameras of the views.
#pragma once

#include <filesystem>

#include "engine/core/image.h"
#include "engine/data/dataset.h"

namespace darb {

/// Gives every view its depth file from FOLDER/depths or, where that does not exist, FOLDER/depth,
/// ignoring case. The file has the photo's name, with or without a leading "images/", with .png,
/// .tif, .tiff or .npy in place of its extension or added to it, and possibly "_depth" before that.
/// Without such a folder, NAME_depth beside the photos is taken. Photos may lack a depth. Notes
/// name files of other kinds, and folders that may have been meant. images: the folder of the
/// photos. Throws Error where a file belongs to no photo. Where FOLDER/sparse/0/depth_params.json
/// exists, the files are inverse depths predicted by a network, as 3DGS takes them: they are left
/// out, with a note.
void add_depths(const std::filesystem::path& folder, const std::filesystem::path& images,
                const DatasetOptions& options, Dataset& dataset);

/// The depth of a view, [H][W] at its camera's size, metres along the optical axis, 0 where nothing
/// was measured. The file may have any size with the photo's aspect. It is undistorted like the
/// photo. Between four measured neighbours within 5 % of each other it is interpolated bilinearly;
/// elsewhere the nearest measured value within a pixel is taken. Throws Error naming the file.
ImageF load_depth(const View& view);

/// Sets dataset.depth_scale, world units a metre: DatasetOptions::depth_scale if given; otherwise,
/// where tracks say which photos see which points, the median ratio of the points' depths to the
/// measured ones, with a note; otherwise it stays as the reader of the source set it (1, except for
/// transforms files with an applied_scale). Throws Error where fewer than 20 points have a measured
/// depth. Views must be fitted first (fit_views).
void find_depth_scale(Dataset& dataset);

}  // namespace darb
