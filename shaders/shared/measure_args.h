// SPDX-License-Identifier: MIT
// Arguments of the passes that measure a device's rates, read by C++ and GLSL alike.
#ifndef DARB_MEASURE_ARGS_H
#define DARB_MEASURE_ARGS_H

#include "types.h"

#define MEASURE_THREADS 64
#define MEASURE_CHAINS 12  // independent of one another, so that latency is hidden
#define MEASURE_STEPS 4096

#ifdef __cplusplus
namespace darb::gpu {
#endif

struct FmaArgs {
    float factor, term;
};

struct CopyArgs {
    uint vectors;
};

#ifdef __cplusplus
}  // namespace darb::gpu
#endif
#endif
