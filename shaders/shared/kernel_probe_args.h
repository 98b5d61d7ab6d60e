// SPDX-License-Identifier: MIT
// Arguments of shaders/kernels/kernel_probe.comp, read by C++ and GLSL.
#ifndef DARB_KERNEL_PROBE_ARGS_H
#define DARB_KERNEL_PROBE_ARGS_H

#include "types.h"

#define KERNEL_PROBE_GROUP 64

#ifdef __cplusplus
namespace darb::gpu {
#endif

struct KernelProbeArgs {
    uint count;      // entries
    float exponent;  // for a kernel with shapes
};

#ifdef __cplusplus
static_assert(sizeof(KernelProbeArgs) == 8);
}  // namespace darb::gpu
#endif
#endif
