// SPDX-License-Identifier: MIT
// Ids of the accuracy choices that the shaders know, shared by C++ and GLSL.
#ifndef DARB_ACCURACY_LIST_H
#define DARB_ACCURACY_LIST_H

// How a projected splat is stored: in float16 its colour, opacity and Cholesky factor are halves,
// 24 bytes in place of 36 that the blend reads. The mean stays float32: a half has steps of 1 px
// at 1,024 px.
#define STORAGE_FLOAT32 0
#define STORAGE_FLOAT16 1

// Order of the splats: by the depth of their centres, as 32-bit floats or as 16-bit keys; or that
// order, mended for each pixel by a window sorted by the depth of the splat at the pixel.
#define DEPTH_ORDER_CENTRE 0
#define DEPTH_ORDER_CENTRE16 1
#define DEPTH_ORDER_PIXEL 2

#define DEPTH_KEY_BITS 16  // for centre16
#define DEPTH_KEY_SHIFT \
    11  // float bits left out: 4,096 keys an octave, 16 octaves from the near plane
#define DEPTH_WINDOW 4u  // splats that a pixel holds back to sort

#endif
