// SPDX-License-Identifier: MIT
// Rounds to half precision in the same way wherever a value is stored as a half. packHalf2x16 may truncate, so the
// value is rounded to nearest even before.
#ifndef DARB_HALF_GLSL
#define DARB_HALF_GLSL

#include "shared/accuracy_list.h"

layout(constant_id = 140) const int STORAGE = STORAGE_FLOAT32;

const float HALF_LEAST = 6.1035156e-5;  // the smallest half with full precision
const float HALF_LARGEST = 65504.0;

float round_half(float x) {
    const float bounded = clamp(x, -HALF_LARGEST, HALF_LARGEST);
    const uint bits = floatBitsToUint(bounded);
    return uintBitsToFloat((bits + 0xFFFu + ((bits >> 13) & 1u)) & ~0x1FFFu);
}

#endif
