// SPDX-License-Identifier: MIT
// Arguments of the projection backward with its fused Adam step, of density control, and of the
// iterates' mean.
#ifndef DARB_OPTIM_ARGS_H
#define DARB_OPTIM_ARGS_H

#include "attribute_list.h"
#include "types.h"

#ifdef __cplusplus
namespace darb::gpu {
#endif

struct ProjectBackwardArgs {
    uint first_splat;  // first of this dispatch; harmonics and their moments are bound from it on
    uint splat_end;    // one past its last
    uint camera_index;
    float low_pass;  // px^2
    // What follows is read with UPDATE_ADAM. Each rate is lr / (1 - beta1^t), by ATTRIBUTE_*; the
    // second moment's correction is common.
    float rate[ATTRIBUTES];
    float inverse_sqrt_correction2;  // 1 / sqrt(1 - beta2^t)
    // Regularisers: weights of the sum of opacities and of the sum of scales, over the splats that
    // the frame shows, or with regularise_unseen = 1 over all.
    float opacity_weight, scale_weight;
    uint regularise_unseen;
    float largest_log_scale;  // no scale grows beyond it
    float clearance;          // world: splats nearer to the camera fade
    float rest_share;         // weight of an iteration's gradient in the mean that a step uses
};

// What project_backward does with a splat's gradients: take the Adam step, store them in the
// buffers of gradients, or add them to what these hold.
#define UPDATE_ADAM 0
#define UPDATE_STORE 1
#define UPDATE_ADD 2

// One attribute's step of adam_update, over the splats of a range.
struct AdamUpdateArgs {
    uint first_splat, splat_count;
    uint floats_in_use;                  // floats per splat to update; the others are left alone
    float rate;                          // as above
    float inverse_sqrt_correction2;      // as above
    float beta1, share1, beta2, share2;  // share = 1 - beta
    float gradient_scale;                // scales what the buffers of gradients hold
    float weight;             // weight of the attribute's regulariser in each view's loss
    float regularise_unseen;  // share of the views whose regularisers act on what they do not show
    float largest;            // STEP_SCALE: no value grows beyond it
    float rest_share;         // STEP_REST: as above
};

// What the views of a step show of a splat is (sum of norms, views); so much less of the latter
// where a gradient was not finite, which the counts of views never make up for: no step is made.
#define VIEWS_BAD -1e9

struct AddArgs {  // to += from
    uint count;   // floats
};

struct FadeNearArgs {
    uint splat_count;
    uint camera_index;
    float clearance;  // world
};

// dL/d(camera) of a splat: the rotation's nine entries by rows, the centre held, then fx, fy, cx,
// cy. Beside them in a sum over splats: dL/d(position).
#define CAMERA_SHARES 13u
#define CAMERA_SUMS 16u
#define CAMERA_SUM_THREADS 64u
#define CAMERA_SUM_GROUPS 256u  // at most
struct CameraSumArgs {
    uint splat_count;
};

// When the harmonics above the first band make a step: in this iteration, of its own gradient; not
// in this one, whose gradient is gathered; in this one, of the mean of what was gathered.
#define REST_EACH 0
#define REST_GATHER 1
#define REST_APPLY 2

// What density control does with a splat; see densify_decide.comp.
#define DENSIFY_KEEP 0
#define DENSIFY_CLONE 1
#define DENSIFY_SPLIT 2
#define DENSIFY_PRUNE 3

struct DensifyArgs {
    uint splat_count;          // N before
    float gradient_threshold;  // NDC units, on the mean over the frames that saw the splat
    float clone_split_scale;   // world: largest standard deviation below clones, above splits
    float prune_opacity;       // below it a splat goes
    float prune_scale;         // world: above it a splat goes; <= 0: off
    uint seed;                 // for the split offsets; differs at each call
};

// One range of the splats after, from one range of the splats before: each is bound from its first
// on.
struct GatherArgs {
    uint to_first, to_count;
    uint from_first, from_count;
    uint stride;     // floats per splat of this attribute, or columns of what lies in blocks
    uint clear_new;  // 1: zero for new splats (moments), 0: copy
};

struct AverageArgs {
    uint count;   // floats
    float share;  // weight of the new value in the mean
};

struct ResetOpacityArgs {
    uint splat_count;
    float logit_max;
};

#ifdef __cplusplus
static_assert(sizeof(ProjectBackwardArgs) == 44 + 4 * ATTRIBUTES);
static_assert(sizeof(AdamUpdateArgs) == 56);
}  // namespace darb::gpu
#endif
#endif
