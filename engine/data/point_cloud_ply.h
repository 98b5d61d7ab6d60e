// SPDX-License-Identifier: MIT
// Point clouds as PLY: x y z and red green blue, as in points3D.ply and nerfstudio's sparse_pc.ply.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/scene/ply_table.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// Float colours must be in [0, 1]. The colours of a splat scene come from its f_dc; points without
/// colours are mid grey. Points with NaN or infinity are dropped and counted in `dropped`. notes:
/// where not null, receives a sentence on each of these cases but the dropped points. Throws Error
/// naming file and record. header: the result of parse_ply_header, where the caller has it already.
PointCloud parse_point_cloud_ply(std::span<const std::byte> file, const std::string& where,
                                 std::size_t& dropped);
PointCloud parse_point_cloud_ply(std::span<const std::byte> file, const PlyHeader& header,
                                 const std::string& where, std::size_t& dropped,
                                 std::vector<std::string>* notes = nullptr);
PointCloud read_point_cloud_ply(const std::filesystem::path& path, std::size_t& dropped,
                                std::vector<std::string>* notes = nullptr);

/// A PLY or LAS file, told apart by content.
PointCloud read_point_cloud(const std::filesystem::path& path, std::size_t& dropped,
                            std::vector<std::string>* notes = nullptr);

// Point clouds as splats: this is how a viewer opens a plain point-cloud PLY.

/// Mean squared distance of each point to its 3 nearest neighbours (fewer where there are no more
/// points), at least 1e-7. position: [P][3]. O(P log P).
std::vector<double> neighbour_distance2(const std::vector<double>& position);

/// One round Gaussian per point, with opacity 0.95 and the point's colour. Its standard deviation
/// is a third of the root of neighbour_distance2, at most four times the median of all, so that
/// stray points stay small.
SplatModel points_as_splats(const PointCloud& points);

}  // namespace darb
