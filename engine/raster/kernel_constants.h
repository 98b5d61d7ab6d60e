// SPDX-License-Identifier: MIT
// The specialization constants of shaders/kernels/kernel.glsl for one kernel.
#pragma once

#include <vector>

#include "engine/gpu/device.h"
#include "engine/gpu/pipeline.h"
#include "engine/kernels/kernel_coefficients.h"

namespace darb {

/// kernel: KERNEL_*. evaluation: EVALUATION_POLYNOMIAL, or EVALUATION_BUILTIN where the kernel has
/// a closed form (else the polynomial runs); more than one pulse is always built-in. Throws Error
/// for an exact footprint that the kernel does not have. degree: kLeastDegree..kFullDegree.
/// The first call takes milliseconds.
SpecConstants kernel_constants(int kernel, Footprint footprint,
                               int evaluation = EVALUATION_POLYNOMIAL, int degree = kFullDegree,
                               float alpha_cutoff = 1 / 255.0f);

// The shaders' kernel contract on the caller's values, for comparisons with the truth:
// shaders/kernels/kernel_probe.comp.

struct KernelProbe {
    float q, opacity;
};
/// w and dw/dq at q; the reach of the opacity; the factor of the projected covariance.
struct KernelAnswer {
    float value, slope, reach, covariance_scale;
};

/// constants: from kernel_constants(). exponent: for a kernel with shapes. Compiles, and waits.
std::vector<KernelAnswer> probe_kernel(Device& device, const SpecConstants& constants,
                                       const std::vector<KernelProbe>& probes, float exponent = 0);

}  // namespace darb
