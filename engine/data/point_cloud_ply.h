// Point clouds as PLY: x y z and red green blue, as points3D.ply and nerfstudio's sparse_pc.ply.
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

/// Float colours are in [0, 1]. A splat scene has those of its f_dc; without colours points are mid
/// grey. Points with NaN or infinity are dropped, `dropped` is their count. notes, where not null,
/// gets a sentence on each of this but the counts. Throws Error naming file and record.
/// header: parse_ply_header's, where that was called before.
PointCloud parse_point_cloud_ply(std::span<const std::byte> file, const std::string& where,
                                 std::size_t& dropped);
PointCloud parse_point_cloud_ply(std::span<const std::byte> file, const PlyHeader& header,
                                 const std::string& where, std::size_t& dropped,
                                 std::vector<std::string>* notes = nullptr);
PointCloud read_point_cloud_ply(const std::filesystem::path& path, std::size_t& dropped,
                                std::vector<std::string>* notes = nullptr);

// Point clouds as splats: what a viewer opens a plain point-cloud PLY with.

/// Mean squared distance of each point to its 3 nearest neighbours (fewer where there are fewer),
/// at least 1e-7. position: [P][3]. O(P log P).
std::vector<double> neighbour_distance2(const std::vector<double>& position);

/// A round Gaussian of opacity 0.95 a point, in its colour. Its standard deviation is a third of
/// the root of neighbour_distance2, at most four times the median of all, so that stray points stay
/// small.
SplatModel points_as_splats(const PointCloud& points);

}  // namespace darb
