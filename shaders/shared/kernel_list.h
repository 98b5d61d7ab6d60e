// SPDX-License-Identifier: MIT
// The list of reconstruction kernels and footprints: ids that C++ and GLSL share. The maths of each
// row exists once, in engine/kernels in double; GLSL gets its coefficients from there.
#ifndef DARB_KERNEL_LIST_H
#define DARB_KERNEL_LIST_H

#define KERNEL_GAUSSIAN 0
#define KERNEL_RAISED_COSINE 1
#define KERNEL_HALF_COSINE_SQUARED 2
#define KERNEL_SINC 3
#define KERNEL_INVERSE_QUADRATIC 4
#define KERNEL_COSINE 5
#define KERNEL_SQUARED_RAISED_COSINE 6
#define KERNEL_INVERSE_MULTIQUADRIC 7
#define KERNEL_PARABOLIC 8
#define KERNEL_COUNT 9

// Rows beyond the list: kernels of the list with more than one pulse. The shaders see the kernel of
// the list, and KERNEL_PULSES.
#define KERNEL_RAISED_COSINE_2_PULSES 9
#define KERNEL_RAISED_COSINE_3_PULSES 10
#define KERNEL_SINC_2_PULSES 11
#define KERNEL_SINC_3_PULSES 12
// Rows beyond the list whose shape each splat has of its own; see kernel_forms.h.
#define KERNEL_BETA 13
#define KERNEL_GENERALIZED_EXPONENTIAL 14
#define KERNEL_GES_PUBLISHED 15
#define KERNEL_ROWS 16
// Blends of two kernels of the list, with a weight of each splat's own. Their id is this + first *
// KERNEL_COUNT + second.
#define KERNEL_BLENDS 100000
#define KERNEL_MAX_PULSES 3

#define FOOTPRINT_PSI 0
#define FOOTPRINT_EXACT 1

#define EVALUATION_POLYNOMIAL 0
#define EVALUATION_BUILTIN 1

#endif
