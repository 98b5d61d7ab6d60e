// SPDX-License-Identifier: MIT
// Blending of one tile, front to back, and its gradient, back to front. Per pixel: alpha =
// min(0.99, opacity w(q)), skipped below the cut-off; C += T alpha colour; T *= 1 - alpha; stop
// before T would fall below the stop, less TRANSMITTANCE_SLACK of it; finally C += T background.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/image.h"
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

/// Indices of the splats that are not culled, sorted by camera z, or by its 16-bit key; equal
/// depths keep index order.
template <class T>
std::vector<std::uint32_t> depth_order(const std::vector<ProjectedSplat<T>>& splats,
                                       const RenderSettings& settings = {});

/// The smallest q over the pixel centres in [x0, x1) x [y0, y1), as a real-valued lower bound (the
/// minimum over the box that the centres span); 0 where the mean lies in it.
template <class T>
T smallest_q(const ProjectedSplat<T>& splat, int x0, int y0, int x1, int y1);

/// Lists a splat in every tile whose box of pixel centres its ellipse q < reach touches. Splats
/// that touch no tile are marked Cull::outside.
template <class T>
TileLists make_tile_lists(int width, int height, std::vector<ProjectedSplat<T>>& splats,
                          const RenderSettings& settings = {});

template <class T>
struct BlendImages {
    Image<T> colour;                    // [H][W][3], not clamped
    Image<T> transmittance;             // [H][W][1], T after the last splat
    Image<T> depth;                     // [H][W][1], sum of T alpha depth
    Image<std::int32_t> contributions;  // [H][W][1], splats that were blended
    Image<T> square;                    // [H][W][1], sum of T alpha depth^2; empty: not wanted
};

template <class T>
void blend_tile(const TileLists& lists, size_t tile, const std::vector<ProjectedSplat<T>>& splats,
                const KernelTable& kernel, const RenderSettings& settings, BlendImages<T>& images);

/// dL/d(image) [H][W][3], and dL/d(1 - T) and dL/d(depth), each [H][W][1] or empty; depth may have
/// a second channel, dL/d(square).
template <class T>
struct ImageGradient {
    const Image<T>& colour;
    const Image<T>& alpha;
    const Image<T>& depth;
};

/// Writes one gradient per entry of the tile's list into intersections[0 .. length), and returns
/// dL/d(background) for this tile's pixels.
template <class T>
Vec3<T> blend_tile_backward(const TileLists& lists, size_t tile,
                            const std::vector<ProjectedSplat<T>>& splats, const KernelTable& kernel,
                            const RenderSettings& settings, const ImageGradient<T>& d_image,
                            ProjectedGradient<T>* intersections);

/// Sums for a profile with this support, R^2.
template <class T>
struct ProfileTarget {
    T support;
    std::span<T> sums;
};

/// Adds to sums[k] the sum over the tile's pixels and splats of opacity dL/dalpha T_k(2 sqrt(u) -
/// 1), with T_k of Chebyshev and u = 1 - q/support: what the gradient of a learned profile is made
/// of.
template <class T>
void add_tile_profile(const TileLists& lists, size_t tile,
                      const std::vector<ProjectedSplat<T>>& splats, const KernelTable& kernel,
                      const RenderSettings& settings, const ImageGradient<T>& d_image,
                      const ProfileTarget<T>& to);

}  // namespace darb::reference
