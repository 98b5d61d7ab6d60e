// SPDX-License-Identifier: MIT
// A surface out of depths: blocks of voxels around it, truncated signed distances in them on the
// device, the zero level by marching tetrahedra, and colours from the views' pictures. Memory on
// the device follows a range of blocks at a time; the result has the same bits for any number of
// ranges, as each voxel depends on the depths alone and vertices are joined by the edge they are
// on. Sources: Curless and Levoy 1996; docs/mesh.md.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "engine/mesh/depth_views.h"
#include "engine/mesh/triangle_mesh.h"

namespace darb {

/// An axis-aligned box, world units; positions relative to SplatModel::origin.
struct WorldBox {
    glm::dvec3 low{0.0}, high{0.0};
};

struct TsdfOptions {
    double voxel = 0;     // side, world units; 0: a pixel on the surface, in the median
    int truncation = 4;   // half width of the band, voxels; 2 to 16
    double farthest = 0;  // depths beyond it do not count; 0: 4 times the median depth
    std::optional<WorldBox> bounds = {};       // what lies outside is left out
    std::uint64_t working_bytes = 512u << 20;  // device memory of a range of blocks and its views
};

struct TsdfReport {
    double voxel = 0, farthest = 0;  // as they were used, world units
    std::size_t blocks = 0, ranges = 0;
};

/// An edge of the voxels, or a diagonal of them, relative to SplatModel::origin.
struct VoxelEdge {
    glm::vec3 from, to;
};

/// What a surface is the zero of, where it is not that of the distances.
struct SurfaceField {
    /// Negative inside, positive outside, NaN where nothing is known, at voxels of which some view
    /// says that its surface is within the band.
    std::function<std::vector<float>(std::span<const glm::vec3> points)> at_voxels;
    /// Puts vertices on the zero, each on its edge, whose ends have different signs.
    std::function<void(std::span<const VoxelEdge> edges, std::vector<glm::vec3>& position)>
        on_edges;
};

/// A block of BLOCK_SIDE voxels a side by its place, in sides of a block.
using BlockPlace = std::array<std::int32_t, 3>;

/// The blocks that the rays of all pixels meet within the band around their depths, in Morton
/// order. Pixels beyond `farthest`, or larger there than 8 voxels, have none.
std::vector<BlockPlace> blocks_of_surface(const std::vector<DepthView>& views,
                                          const TsdfOptions& options, const glm::dvec3& origin);

/// Fills in the defaults that depend on the depths. Throws Error where no view has any.
TsdfOptions with_defaults(TsdfOptions options, const std::vector<DepthView>& views);

/// Positions, faces and normals of the zero level; origin: SplatModel::origin, to which positions
/// are relative. Throws Error where no view sees a surface, and NoRoom where the result would not
/// fit into the memory of the host, naming a voxel for which it would. field: another field, whose
/// zero is looked for in the same voxels.
TriangleMesh fuse_depths(Device& device, const std::vector<DepthView>& views,
                         const glm::dvec3& origin, const TsdfOptions& options, TsdfReport& report,
                         const MeshProgress& progress = {}, const SurfaceField* field = nullptr);

/// Unit normals of the vertices: the mean of those of their faces, by area.
void set_normals(TriangleMesh& mesh);

/// Colours of points from the views' pictures. origin: of the points, in the world. voxel: as in
/// the report; a point is on the surface of a view that is within two of it. working_bytes: as
/// above.
std::vector<glm::u8vec3> colours_at(Device& device, const std::vector<DepthView>& views,
                                    const glm::dvec3& origin, const std::vector<glm::vec3>& points,
                                    double voxel, std::uint64_t working_bytes,
                                    const MeshProgress& progress = {});

/// Those of the vertices.
void bake_colours(Device& device, const std::vector<DepthView>& views, TriangleMesh& mesh,
                  double voxel, std::uint64_t working_bytes, const MeshProgress& progress = {});

}  // namespace darb
