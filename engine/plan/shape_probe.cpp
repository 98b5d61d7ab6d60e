#include "engine/plan/shape_probe.h"

#include <fmt/format.h>

#include "engine/kernels/kernel_family.h"

namespace darb {

std::string ShapeProbe::advice() const {
    const std::string measured =
        fmt::format("{:+.2f} dB on held-out photos for {:+.0f} % of time", gain_db(), 100 * price);
    return pays() ? fmt::format("{}: train with --kernel {}", measured, kernel_name(kernel))
                  : fmt::format("{}: stay with --kernel {}; less than {} dB may be chance",
                                measured, kernel_name(fixed_kernel), kLeastGain_db);
}

}  // namespace darb
