#include "tools/paper/rings.h"

#include <cmath>

#include "engine/kernels/kernel_profile.h"

namespace darb {

Rings rings_of(int kernel, int pulses) {
    const DerivedKernel& with = derived_kernel(kernel_with_pulses(kernel, pulses).value());
    const double radius = std::sqrt(with.row().support);
    const double first = std::sqrt(with.pulses().front().end);
    return {kernel, pulses, radius, with.psi(),
            1 - with.radial_moment(first, 2) / with.radial_moment(radius, 2)};
}

std::vector<Rings> all_rings() {
    std::vector<Rings> all;
    for (const int kernel : {KERNEL_RAISED_COSINE, KERNEL_SINC})
        for (int pulses = 1; pulses <= KERNEL_MAX_PULSES; ++pulses)
            all.push_back(rings_of(kernel, pulses));
    return all;
}

}  // namespace darb
