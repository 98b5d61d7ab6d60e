// SPDX-License-Identifier: MIT
// The attributes of a splat by number: the order of their buffers, moments, gradients and rates, in
// bindings and in checkpoints. engine/scene/splat_model.h says what each is.
#ifndef DARB_ATTRIBUTE_LIST_H
#define DARB_ATTRIBUTE_LIST_H

#define ATTRIBUTE_POSITION 0
#define ATTRIBUTE_LOG_SCALE 1
#define ATTRIBUTE_ROTATION 2
#define ATTRIBUTE_OPACITY_LOGIT 3
#define ATTRIBUTE_SH_DC 4
#define ATTRIBUTE_SH_REST 5
#define ATTRIBUTE_SHAPE 6
#define ATTRIBUTES 7

// An attribute with several coefficients lies on the device in blocks of this many splats; in each
// block one column of as many vec4 follows the other (shaders/lib/rows.glsl).
#define ROW_BLOCK 8u

// What a step of the optimizer does besides Adam.
#define STEP_PLAIN 0
#define STEP_SCALE 1    // the regulariser of scales, and the limit of the largest scale
#define STEP_OPACITY 2  // the regulariser of opacities
#define STEP_REST 3     // one step in several iterations, from their mean gradient

// The zeroth spherical harmonic, sqrt(1 / pi) / 2: colour = 0.5 + SH_C0 * sh_dc + higher bands.
#define SH_C0 0.28209479177387814

#endif
