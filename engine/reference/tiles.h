// Which splats touch which tile, in depth order: the reference's counterpart of emit and sort.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/reference/projection.h"

namespace darb::reference {

constexpr int kTileSize = 16;  // px

struct TileLists {
    int tiles_x = 0, tiles_y = 0;
    std::vector<std::uint32_t> begin;   // [T+1] into splats
    std::vector<std::uint32_t> splats;  // [K] splat index, nearest first within a tile

    size_t tile_count() const { return static_cast<size_t>(tiles_x) * tiles_y; }
    size_t intersection_count() const { return splats.size(); }
};

/// Indices of the splats that are not culled, by camera z, or by its 16-bit key; equal depths keep
/// index order.
template <class T>
std::vector<std::uint32_t> depth_order(const std::vector<ProjectedSplat<T>>& splats,
                                       const RenderSettings& settings = {});

/// The smallest q of the pixel centres in [x0, x1) x [y0, y1), as a real-valued lower bound (the
/// minimum over the box that the centres span); 0 when the mean lies in it.
template <class T>
T smallest_q(const ProjectedSplat<T>& splat, int x0, int y0, int x1, int y1);

/// A splat is listed in every tile with a pixel centre box that its ellipse q < reach touches.
/// Splats that touch none are marked Cull::outside.
template <class T>
TileLists make_tile_lists(int width, int height, std::vector<ProjectedSplat<T>>& splats,
                          const RenderSettings& settings = {});

}  // namespace darb::reference
