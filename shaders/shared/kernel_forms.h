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

#define KERNEL_MAX_DEGREE 8

#endif
