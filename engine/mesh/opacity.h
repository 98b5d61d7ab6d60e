// SPDX-License-Identifier: MIT
// The opacity field of a scene and its surface. O(x) is the least, over the views that have x in
// their pictures, of 1 - T, the share of the light that the splats before x take on its way to the
// camera. Inside is O >= 1 - level: a point is free as soon as one view sees it. Nothing is
// averaged over a band, so thin things stay. Sources: Gaussian Opacity Fields (Yu, Sattler and
// Geiger 2024); docs/mesh.md.
#pragma once

#include <span>
#include <vector>

#include "engine/mesh/depth_views.h"
#include "engine/mesh/triangle_mesh.h"
#include "engine/mesh/tsdf.h"
#include "engine/render/renderer.h"

namespace darb {

class OpacityField {
  public:
    /// views: their cameras are asked. origin: SplatModel::origin. options: those by which the
    /// views were made; `expected` is no reading of a field. working_bytes: device memory beside
    /// the renderer's.
    OpacityField(Renderer& renderer, const std::vector<DepthView>& views, const glm::dvec3& origin,
                 const DepthViewOptions& options, std::uint64_t working_bytes);

    /// 1 - O: the most light that is left at each point in a view; -1 where no view has it.
    /// points: relative to the origin. A point of which a view leaves more than `enough` is not
    /// asked of the views behind it, and has what that view said.
    std::vector<float> light(std::span<const glm::vec3> points, float enough,
                             const MeshProgress& progress = {});

    float level() const { return options_.level; }

  private:
    Renderer* renderer_;
    std::vector<Camera> cameras_;
    glm::dvec3 origin_;
    DepthViewOptions options_;
    std::size_t points_at_a_time_;
};

/// The level's surface: where it lies in the blocks around the views' depths, on the edges of
/// their voxels. Otherwise as fuse_depths.
TriangleMesh opacity_surface(Device& device, OpacityField& field,
                             const std::vector<DepthView>& views, const glm::dvec3& origin,
                             const TsdfOptions& options, TsdfReport& report,
                             const MeshProgress& progress = {});

}  // namespace darb
