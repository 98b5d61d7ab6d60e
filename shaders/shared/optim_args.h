// SPDX-License-Identifier: MIT
// Arguments of the projection's backward pass with its fused Adam step, of density control, and of
// the iterates' mean.
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
    // The members from here on are read with UPDATE_ADAM. Each rate is lr / (1 - beta1^t), by
    // ATTRIBUTE_*; all share the second moment's correction.
    float rate[ATTRIBUTES];
    float inverse_sqrt_correction2;  // 1 / sqrt(1 - beta2^t)
    // Regularisers: weights of the sum of opacities and of the sum of scales. They act on the
    // splats that the frame shows, or on all with regularise_unseen = 1.
    float opacity_weight, scale_weight;
    uint regularise_unseen;
    float largest_log_scale;  // no scale grows beyond it
    float clearance;          // world: splats nearer to the camera fade
    float rest_share;         // weight of one iteration's gradient in the mean that a step uses
    float flatness_weight;    // weight of the sum of smallest scales, with FLATNESS
};

// What project_backward does with a splat's gradients: it takes the Adam step, stores them in the
// buffers of gradients, or adds them to what these hold.
#define UPDATE_ADAM 0
#define UPDATE_STORE 1
#define UPDATE_ADD 2

// One attribute's step of adam_update, over the splats of a range.
struct AdamUpdateArgs {
    uint first_splat, splat_count;
    uint floats_in_use;                  // floats per splat to update; the others are left alone
    float rate;                          // as in ProjectBackwardArgs
    float inverse_sqrt_correction2;      // as in ProjectBackwardArgs
    float beta1, share1, beta2, share2;  // share = 1 - beta
    float gradient_scale;                // factor for what the buffers of gradients hold
    float weight;           // weight of the attribute's regulariser in each view's loss
    float flatness_weight;  // STEP_SCALE with FLATNESS: as in ProjectBackwardArgs, in each view's
                            // loss
    // share of the views that do not show a splat in which the regularisers act all the same
    float regularise_unseen;
    float largest;     // STEP_SCALE: no value grows beyond it
    float rest_share;  // STEP_REST: as in ProjectBackwardArgs
};

// What the views of a step show of a splat is (sum of norms, views). A gradient that is not finite
// lowers the latter by so much that counts of views never make up for it, and no step is made.
#define VIEWS_BAD -1e9

struct AddArgs {  // to += from
    uint count;   // floats
};

struct FadeNearArgs {
    uint splat_count;
    uint camera_index;
    float clearance;  // world
};

// dL/d(camera) of a splat: the rotation's nine entries by rows with the centre held, then fx, fy,
// cx, cy, and the shutter's turn and move. A sum over splats also has dL/d(position).
#define CAMERA_SHARES 19u
#define CAMERA_SHARE_CENTRE 11u  // of cx
#define CAMERA_SHARE_SHUTTER 13u
#define CAMERA_SUMS 22u
#define CAMERA_SUM_THREADS 64u
#define CAMERA_SUM_GROUPS 256u  // at most
struct CameraSumArgs {
    uint splat_count;
};

// When the harmonics above the first band make a step: in this iteration, from its own gradient;
// not in this one, whose gradient is only gathered; or in this one, from the mean of what was
// gathered.
#define REST_EACH 0
#define REST_GATHER 1
#define REST_APPLY 2

// What density control does with a splat; see densify_decide.comp.
#define DENSIFY_KEEP 0
#define DENSIFY_CLONE 1
#define DENSIFY_SPLIT 2
#define DENSIFY_PRUNE 3

struct DensifyArgs {
    uint splat_count;  // N before
    // NDC units, compared with the mean over the frames that saw the splat
    float gradient_threshold;
    // world: splats with a smaller largest standard deviation are cloned, others are split
    float clone_split_scale;
    float prune_opacity;  // a splat below it is pruned
    float prune_scale;    // world: a splat above it is pruned; <= 0: off
    uint seed;            // for the split offsets; differs at each call
};

// One range of the splats afterwards, from one range of the splats before. Each is bound from its
// first splat on.
struct GatherArgs {
    uint to_first, to_count;
    uint from_first, from_count;
    uint stride;     // floats per splat of this attribute, or columns where it lies in blocks
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
static_assert(sizeof(ProjectBackwardArgs) == 48 + 4 * ATTRIBUTES);
static_assert(sizeof(AdamUpdateArgs) == 60);
}  // namespace darb::gpu
#endif
#endif
