// SPDX-License-Identifier: MIT
// Arguments of the passes of the strategy mcmc, and of the resolution ramp.
#ifndef DARB_STRATEGY_ARGS_H
#define DARB_STRATEGY_ARGS_H

#include "types.h"

#define RELOCATION_OPACITIES 128  // columns of the table of scales
// rows: splats in the place of one, as many as 3DGS-MCMC counts at most
#define RELOCATION_COUNTS 51

#ifdef __cplusplus
namespace darb::gpu {
#endif

struct RelocationArgs {
    uint splat_count;    // N before
    uint splats_after;   // N after: draws fill the dead places first, then those behind the last
    uint dead_count;     // how many of the N splats are dead
    uint weight_total;   // sum of the weights of the live splats
    float dead_opacity;  // a splat with less is dead
    float weight_scale;  // integer weight of opacity 1; the sum of all stays below 2^32
    uint seed;           // for the draws; differs at each call
};

struct NoiseArgs {
    uint splat_count;
    uint seed;           // differs at each iteration
    float rate;          // 1 / world unit: factor of the covariance times a normal vector
    float dead_opacity;  // the noise is gated by sigmoid(-100 (opacity - dead_opacity))
};

struct DownsampleArgs {
    uint width, height;          // px, of the photo
    uint out_width, out_height;  // px
};

#ifdef __cplusplus
static_assert(sizeof(RelocationArgs) == 28);
static_assert(sizeof(NoiseArgs) == 16);
}  // namespace darb::gpu
#endif
#endif
