// SPDX-License-Identifier: MIT
// Argument structs of the render passes, read by C++ and GLSL alike (scalar layout).
// N splats, V visible, K splat-tile intersections, T tiles.
#ifndef DARB_RENDER_ARGS_H
#define DARB_RENDER_ARGS_H

#include "limits.h"
#include "types.h"

#define SPLAT_GROUP 64     // threads of the passes that run once per splat or intersection
#define MAX_GROUPS 65535u  // the portable limit of one dispatch dimension
#define CULL_REASONS 8     // see CULL_* below

// An intersection names its splat in the low bits. The high bits say which of the tile's four 8 x 8
// blocks its ellipse touches: bit 0 the top left, 1 the top right, 2 the bottom left, 3 the bottom
// right.
#define INTERSECTION_BLOCK_SHIFT 28
#define INTERSECTION_SPLAT_MASK 0x0FFFFFFFu

// How many intersections of one tile's list a dispatch of a blend pass processes; longer lists take
// several dispatches. The lavapipe of Mesa 22.3 ends every loop of a subgroup once all of them
// together have made 65,535 rounds, which cuts a list after 51,000 intersections forward and 10,700
// backward. A GPU may also end a dispatch that takes seconds.
#define LIST_SEGMENT 8192u

// How many intersections of a tile's list lie between two checkpoints of the forward blend, for the
// backward blend that works on buckets of them side by side (shaders/lib/bucket.glsl). Where
// subgroups are larger, it is as many as they have threads. A record is four floats for each pixel
// of the tile.
#define BUCKET_INTERSECTIONS 32u
#define CHECKPOINT_BYTES (TILE_SIZE * TILE_SIZE * 16u)

// How many sums the backward blend leaves for an intersection, besides one more in a buffer of its
// own, and the number of windows in which their buffer is bound where one binding does not hold it.
#define PARTIALS 8u
#define PARTIAL_WINDOWS 5u

// Intersections of a splat whose sums partial_chunks.comp adds up together, where the splat has
// more of them. Eight threads share each of the PARTIALS sums.
#define SUM_CHUNK 64

#define TILE_ORDER_THREADS 256  // of the one workgroup that orders tiles

// A splat with more intersections than this is huge: one thread would still write them long after
// all others are done. With COOPERATE of emit.comp, a workgroup of EMIT_HUGE_THREADS writes them,
// one cell of the cover per thread.
#define HUGE_INTERSECTIONS 256u
#define EMIT_HUGE_THREADS 64  // cells of a cover
#define EMIT_HUGE_GROUPS 64u  // workgroups that share the huge splats of a frame

// What did not fit into a frame; bits of FrameStatus.overflow.
#define OVERFLOW_INTERSECTIONS 1u  // more intersections than their buffers hold
#define OVERFLOW_LISTS 2u          // a tile's list is longer than the blend dispatches take on
#define OVERFLOW_TOTAL 4u          // the number of intersections exceeds 32 bits
#define OVERFLOW_DEPTHS 8u         // a depth is beyond what SHORT_DEPTH_BITS reach

// Bits of a depth key in three digits: sixteen powers of two from the near plane on.
#define SHORT_DEPTH_BITS 27

// Why a splat takes no part in a frame; indexes FrameStatus.culled.
#define CULL_NEAR 0        // not in front of the near plane, or position not finite
#define CULL_ROTATION 1    // quaternion without a direction
#define CULL_OPACITY 2     // below the alpha cut-off everywhere
#define CULL_COVARIANCE 3  // determinant not positive or not finite
#define CULL_OUTSIDE 4     // touches no tile
#define CULL_COLOUR 5      // colour not finite

#ifdef __cplusplus
namespace darb::gpu {
#endif

// One camera as the shaders see it. World to camera: p = rows * p_world + translation.
struct CameraData {
    vec3 row0;
    vec3 row1;
    vec3 row2;
    vec3 centre;       // world
    vec3 centre_rest;  // what rounding to float32 leaves of the centre
    vec2 focal;        // px
    vec2 principal;    // px
    vec2 ratio_min;    // x/z and y/z are clamped to [ratio_min, ratio_max] in the Jacobian
    vec2 ratio_max;
    uint width;   // px
    uint height;  // px
    uint tiles_x;
    uint tiles_y;
    float near_plane;  // world units along z
    // The terms of engine/scene/camera.h's lens, read where the effect is on.
    vec4 lens_radial;
    vec3 lens_rational;
    vec2 lens_tangential;
    vec2 lens_prism;
    vec2 lens_front;
    float lens_fold;
    vec2 lens_radial_high;
    vec2 lens_prism_high;
    uint lens_after;  // 1: tangential and prism act after the radial factor
    // Those of its shutter, read where that effect is on.
    vec3 shutter_turn;
    vec3 shutter_move;
};

// The counts of one frame, written by the passes, read by later passes and afterwards by the host.
struct FrameStatus {
    uint visible;        // V
    uint intersections;  // K as wanted, may exceed the capacity
    uint overflow;       // OVERFLOW_*: the frame must be repeated; sticky until the host clears it
    uint bad_gradients;  // splats whose gradient was not finite
    uint culled[CULL_REASONS];
    uint longest_list;  // intersections of the tile that has the most
    uint huge_splats;   // splats of more than HUGE_INTERSECTIONS intersections
};

// VkDispatchIndirectCommand of the passes over V and over K.
struct FrameGroups {
    uint visible_x, visible_y, visible_z;
    uint intersections_x, intersections_y, intersections_z;
};

struct ProjectArgs {
    uint first_splat;  // first splat of this dispatch; harmonics are bound from it on
    uint splat_end;    // one past its last
    uint camera_index;
    float low_pass;  // px^2, added to the diagonal of the projected covariance
};

struct CompactArgs {
    uint splat_count;  // N
    float near_plane;  // world units along z, where the 16-bit depth keys begin
};

struct SplatArgs {     // gather_counts
    uint splat_count;  // N
};

struct IntersectionArgs {  // frame_groups, emit, tile_ranges, list_lengths, tile_order
    uint intersection_capacity;
    uint tiles_x;
    uint tile_count;
    uint list_capacity;  // the longest list of a tile that the blend dispatches process
};

struct BlendArgs {
    uint width;   // px
    uint height;  // px
    uint tiles_x;
    float background_r, background_g, background_b;
    uint segment;   // which segment of every list this dispatch takes, where SEGMENT > 0
    uint segments;  // how many segments there are
};

struct BucketArgs {
    uint width;   // px
    uint height;  // px
    uint tiles_x;
    uint records;  // records that the buffers hold
};

struct UpsampleArgs {
    uint small_width, small_height;  // px, of the image that was rendered
    uint width, height;              // px, of the result
};

#ifdef __cplusplus
static_assert(sizeof(CameraData) == 212);
static_assert(sizeof(FrameStatus) == 56);
static_assert(sizeof(FrameGroups) == 24);
}  // namespace darb::gpu
#endif
#endif
