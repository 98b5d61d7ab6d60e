// Point clouds as PLY: x y z and red green blue, as points3D.ply and nerfstudio's sparse_pc.ply.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/scene/ply_table.h"

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

}  // namespace darb
