// The specialization constants of shaders/kernels/kernel.glsl for one kernel.
#pragma once

#include "engine/gpu/pipeline.h"
#include "engine/kernels/kernel_coefficients.h"

namespace darb {

/// kernel: KERNEL_*. evaluation: EVALUATION_POLYNOMIAL, or EVALUATION_BUILTIN where the kernel has
/// a closed form (else the polynomial runs); more than one pulse is always built-in. Throws Error
/// for an exact footprint that the kernel has not. degree: kLeastDegree..kFullDegree. Milliseconds
/// at first.
SpecConstants kernel_constants(int kernel, Footprint footprint,
                               int evaluation = EVALUATION_POLYNOMIAL, int degree = kFullDegree,
                               float alpha_cutoff = 1 / 255.0f);

}  // namespace darb
