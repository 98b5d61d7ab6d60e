// Blending of one tile, front to back, and its gradient, back to front.
// Per pixel: alpha = min(0.99, opacity w(q)), skipped below the cut-off; C += T alpha colour;
// T *= 1 - alpha; stop before T would fall below the stop, less TRANSMITTANCE_SLACK of it; at the
// end C += T background.
#pragma once

#include "engine/core/image.h"
#include "engine/reference/projection.h"
#include "engine/reference/tiles.h"

namespace darb::reference {

template <class T>
struct BlendImages {
    Image<T> colour;                    // [H][W][3], not clamped
    Image<T> transmittance;             // [H][W][1], T after the last splat
    Image<T> depth;                     // [H][W][1], sum of T alpha depth
    Image<std::int32_t> contributions;  // [H][W][1], splats that were blended
};

template <class T>
void blend_tile(const TileLists& lists, size_t tile, const std::vector<ProjectedSplat<T>>& splats,
                const KernelTable& kernel, const RenderSettings& settings, BlendImages<T>& images);

/// dL/d(image), [H][W][3], dL/d(1 - T) and dL/d(depth), [H][W][1] or empty.
template <class T>
struct ImageGradient {
    const Image<T>& colour;
    const Image<T>& alpha;
    const Image<T>& depth;
};

/// Writes one gradient per entry of the tile's list into intersections[0 .. length), and returns
/// dL/d(background) of this tile's pixels.
template <class T>
Vec3<T> blend_tile_backward(const TileLists& lists, size_t tile,
                            const std::vector<ProjectedSplat<T>>& splats, const KernelTable& kernel,
                            const RenderSettings& settings, const ImageGradient<T>& d_image,
                            ProjectedGradient<T>* intersections);

}  // namespace darb::reference
