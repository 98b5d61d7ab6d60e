// SPDX-License-Identifier: MIT
// The forms of arithmetic by which the shaders compute the kernels; see
// shaders/kernels/kernel.glsl.
#ifndef DARB_KERNEL_FORMS_H
#define DARB_KERNEL_FORMS_H

// w = u^a P(x), x = t or t^2, u = 1 - x, t = q/R^2: every kernel of compact support
#define KERNEL_FORM_COMPACT 0
// w = 2^n P(f), n + f = -q/2 log2(e)
#define KERNEL_FORM_GAUSSIAN 1
// w = (1+q)^-1 or (1+q)^-1/2 cut at R^2, and the exact footprints of these two
#define KERNEL_FORM_QUADRIC 2

// 1/2 + 1/2 cos x or |sin x / x| with rings, x proportional to d. It uses the built-in functions,
// and in place of the coefficients it has the q of the peak and of the end of each pulse.
#define KERNEL_FORM_RINGS 3

// w = (1 - q/R^2)^e = 2^(e log2(1 - q/R^2)), with 2^x by P as for the Gaussian and an e of each
// splat's own. With the footprint psi e = b, with exact b + 1/2; b = BETA_START exp(shape), held
// within the bounds.
#define KERNEL_FORM_BETA 4

#define BETA_SUPPORT 13.0        // R^2: with BETA_START the second moment is the Gaussian's
#define BETA_START 4.0           // b of shape 0
#define BETA_EXPONENT_LEAST 1.0  // below it the slope at the edge is unbounded
#define BETA_EXPONENT_MOST 64.0

// w = exp(-((q + s)^(t/2) - s^(t/2)) / 2), with a t of each splat's own: EXPONENTIAL_START
// exp(shape), held within the bounds. Powers of two are computed as BETA's.
#define KERNEL_FORM_EXPONENTIAL 5

#define EXPONENTIAL_START 2.0  // t of shape 0: the Gaussian, whatever s is
#define EXPONENTIAL_LEAST 1.0  // below it the slope along d is unbounded at the centre
#define EXPONENTIAL_MOST 8.0
#define EXPONENTIAL_SOFTENING 0.0009765625  // s = 2^-10
#define EXPONENTIAL_SOFTENING_LOG2 -10.0
// P in ln psi = (x - 1/2) P(x), x = 1/t; rising powers.
#define EXPONENTIAL_PSI \
    3.24274337, 5.40768433, -8.51232766, 12.3217168, -11.9811003, 6.62186212, -1.5554585

// w = (1 - m) w1 + m w2, with an m of each splat's own, for two kernels of other forms. Only the
// row has this form: shaders see the form of the first kernel, and BLENDED.
#define KERNEL_FORM_BLEND 6

// w = exp(-q/2) and psi = f^2, f = 2 / (1 + exp(-GES_STRENGTH (t - GES_START))), with a t of each
// splat's own: GES_START + shape, held within the bounds where f is 0.005 (below which the
// published program prunes) and 1.995.
#define KERNEL_FORM_GES 7

#define GES_START 2.0
#define GES_STRENGTH 0.1
#define GES_LEAST -58.0
#define GES_MOST 62.0

// Rows of density control's tables over the shape, evenly spaced from the kernel's first shape to
// its last.
#define SHAPE_ROWS 16

#define KERNEL_MAX_DEGREE 8

#endif
