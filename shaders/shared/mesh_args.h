// SPDX-License-Identifier: MIT
// Arguments and sizes of the passes that fuse depths into a surface.
#ifndef DARB_MESH_ARGS_H
#define DARB_MESH_ARGS_H

#include "render_args.h"
#include "types.h"

// Voxels of a block, along a side and in all. The distances stand at the voxels' corners nearest to
// the world's 0.
#define BLOCK_SIDE 8u
#define BLOCK_VOXELS 512u
#define NO_BLOCK 0xFFFFFFFFu
#define MESH_GROUP 64u  // threads of a workgroup

// Other views that one is compared with, and how far depths may be apart to agree, as a share.
#define AGREE_VIEWS 4u
#define AGREE_SHARE 0.01
// Depths of four neighbouring pixels that are further apart are not of one surface.
#define SURFACE_SPREAD 0.04

#ifdef __cplusplus
namespace darb::gpu {
#endif

// A pinhole with its depths, 0 where there is none, and colours, as they lie in the buffers of a
// batch of views.
struct MeshView {
    CameraData camera;
    uint first;  // its first pixel there
};

struct AgreeArgs {
    uint others;  // views behind the first that it is compared with
    uint least;   // that must agree, where so many look there; else all
};

struct IntegrateArgs {
    uint blocks;
    uint views;
    float voxel;     // side, world units
    float band;      // half width of the band, world units
    float farthest;  // depths beyond it do not count
};

struct SurfaceArgs {
    uint blocks;  // of the range and the shell around it
    uint own;     // those of the range, which come first; faces are theirs alone
    float voxel;
};

struct BakeArgs {
    uint vertices;
    uint views;
    float tolerance;  // world units: how far a vertex may be behind the surface of a view
};

#ifdef __cplusplus
static_assert(sizeof(MeshView) == sizeof(CameraData) + 4);
static_assert(sizeof(AgreeArgs) == 8);
static_assert(sizeof(IntegrateArgs) == 20);
static_assert(sizeof(SurfaceArgs) == 12);
static_assert(sizeof(BakeArgs) == 12);
}  // namespace darb::gpu
#endif
#endif
