// SPDX-License-Identifier: MIT
// From a folder of panoramas to a data set, through a COLMAP that knows flat pictures only: each
// panorama is cut into views, COLMAP finds the cameras of these, and a panorama gets the pose on
// which its views agree.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/data/run_colmap.h"
#include "engine/scene/panorama.h"

namespace darb {

/// The views that COLMAP gets of a panorama: 90 degrees wide, and 60 degrees apart around the
/// horizon, so that neighbours overlap. Named by their degrees, "000" to "300".
inline constexpr std::size_t kPanoramaViews = 6;
const std::array<CubeFace, kPanoramaViews>& panorama_views();

/// A pose that takes world to camera coordinates.
struct PanoramaPose {
    glm::dmat3 rotation{1.0};
    glm::dvec3 translation{0.0};
    std::size_t agree = 0;  // number of the views that agree on it
    glm::dvec3 centre() const { return -(glm::transpose(rotation) * translation); }
};

/// The pose on which most views of a panorama agree: within 2 degrees and `reach` world units.
/// views: what each view says of the panorama's pose. Nothing where there are none.
std::optional<PanoramaPose> agreed_pose(std::span<const PanoramaPose> views, double reach);

/// Which panoramas are compared with which, first < second: all with all, or with `neighbours` each
/// with the next four and with those 8, 16, 32 and so on farther.
std::vector<std::pair<std::size_t, std::size_t>> panorama_pairs(std::size_t count, bool neighbours);

/// Writes a COLMAP model, as text, of panoramas without cameras: run.photos are these, and names
/// those of its files, in order. Finds the cameras of their views in run.workspace/views. Returns
/// the data set's folder, run.workspace/dense, with images and sparse. run.stop and what is used
/// again are as with run_colmap. Throws Error where colmap is not installed or finds nothing, and
/// ColmapStopped.
std::filesystem::path find_panorama_cameras(const ColmapRun& run,
                                            const std::vector<std::string>& names,
                                            const ColmapReports& reports);

}  // namespace darb
