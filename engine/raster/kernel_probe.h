// The kernel contract of the shaders on values of the caller's, for who compares it with the truth:
// shaders/kernels/kernel_probe.comp.
#pragma once

#include <vector>

#include "engine/gpu/device.h"
#include "engine/gpu/pipeline.h"

namespace darb {

struct KernelProbe {
    float q, opacity;
};
/// w and dw/dq at q; the reach of the opacity; what multiplies the projected covariance.
struct KernelAnswer {
    float value, slope, reach, covariance_scale;
};

/// constants: of kernel_constants. exponent: of a kernel with shapes. Compiles, and waits.
std::vector<KernelAnswer> probe_kernel(Device& device, const SpecConstants& constants,
                                       const std::vector<KernelProbe>& probes, float exponent = 0);

}  // namespace darb
