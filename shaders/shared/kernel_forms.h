// The forms of arithmetic that serve the kernels in the shaders; see shaders/kernels/kernel.glsl.
#ifndef DARB_KERNEL_FORMS_H
#define DARB_KERNEL_FORMS_H

// w = u^a P(x), x = t or t^2, u = 1 - x, t = q/R^2: every kernel of compact support
#define KERNEL_FORM_COMPACT 0
// w = 2^n P(f), n + f = -q/2 log2(e)
#define KERNEL_FORM_GAUSSIAN 1
// w = (1+q)^-1 or (1+q)^-1/2 cut at R^2, and the exact footprints of these two
#define KERNEL_FORM_QUADRIC 2

// 1/2 + 1/2 cos x or |sin x / x| with rings, x proportional to d: the built-in functions, and in
// place of the coefficients the q of the peak and of the end of each pulse
#define KERNEL_FORM_RINGS 3

// w = (1 - q/R^2)^e = 2^(e log2(1 - q/R^2)), 2^x by P as the Gaussian, e of each splat: with the
// footprint psi e = b, with exact b + 1/2, b = BETA_START exp(shape), held within the bounds
#define KERNEL_FORM_BETA 4

#define BETA_SUPPORT 13.0   // R^2: with BETA_START the second moment is the Gaussian's
#define BETA_START 4.0      // b of shape 0
#define EXPONENT_LEAST 1.0  // below it the slope at the edge grows without bound
#define EXPONENT_MOST 64.0

// Rows of density control's tables over the shape, evenly from the first to the last.
#define SHAPE_ROWS 16
#define SHAPE_FIRST -2.1
#define SHAPE_LAST 2.8

#define KERNEL_MAX_DEGREE 8

#endif
