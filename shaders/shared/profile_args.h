// SPDX-License-Identifier: MIT
// Sizes and arguments of the passes by which the profile of a kernel is learned, read by C++ and
// GLSL alike.
#ifndef DARB_PROFILE_ARGS_H
#define DARB_PROFILE_ARGS_H

#include "types.h"

// Sums over pixels and splats of G T_k(2 sqrt(u) - 1), k from 0, with G = opacity dL/dalpha and
// u = 1 - q/R^2. From these follows the gradient by every parameter of the profile, as
// dw/d(parameter) is a polynomial of sqrt(u) of a lower degree.
#define PROFILE_SUMS 14

#define PROFILE_ADD_STRANDS 16  // threads that share the rows of one sum

#ifdef __cplusplus
namespace darb::gpu {
#endif

struct ProfileSumArgs {
    uint rows;  // one a tile
};

#ifdef __cplusplus
static_assert(sizeof(ProfileSumArgs) == 4);
}  // namespace darb::gpu
#endif
#endif
