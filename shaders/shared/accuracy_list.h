// SPDX-License-Identifier: MIT
// Ids of the accuracy choices that the shaders know, shared by C++ and GLSL.
#ifndef DARB_ACCURACY_LIST_H
#define DARB_ACCURACY_LIST_H

// How a projected splat is stored. With float16, its colour, opacity and Cholesky factor are
// halves, and the blend reads 24 bytes in place of 36. The mean stays float32, because a half has
// steps of 1 px at 1,024 px.
#define STORAGE_FLOAT32 0
#define STORAGE_FLOAT16 1

// The arithmetic of the two blends. With fast16 two pixels of a thread form a pair whose exponent
// and opacity are computed in half precision; transmittance and all sums stay float32.
#define ARITHMETIC_FLOAT32 0
#define ARITHMETIC_FAST16 1

// The order of the splats: by the depth of their centres, as 32-bit floats or as 16-bit keys; or
// that order corrected for each pixel by a window that is sorted by the splat's depth at the pixel.
#define DEPTH_ORDER_CENTRE 0
#define DEPTH_ORDER_CENTRE16 1
#define DEPTH_ORDER_PIXEL 2

#define DEPTH_KEY_BITS 16  // for centre16
#define DEPTH_KEY_SHIFT \
    11  // float bits dropped: 4,096 keys per octave, 16 octaves from the near plane
#define DEPTH_WINDOW 4u  // splats that a pixel holds back to sort

// How a splat's shape reaches the picture: by the Jacobian of the camera at its centre; by sigma
// points, each through the camera; or by sigma points where the Jacobian changes by more than
// PROJECTION_SHARE of itself along the splat's longest standard deviation.
#define PROJECTION_JACOBIAN 0
#define PROJECTION_UNSCENTED 1
#define PROJECTION_AUTO 2
#define PROJECTION_SHARE 0.05
// A splat has sigma points only where each is farther from the camera's plane than this share of
// the depth of the centre.
#define SIGMA_NEAREST 0.5

#endif
