#include "viewer/resolution.h"

#include <algorithm>
#include <cmath>

namespace darb {

namespace {
constexpr double kSteps = 32, kSmallest = 1.0 / 8;
}

double ResolutionControl::moving_scale() const {
    return std::clamp(std::floor(scale_ * kSteps) / kSteps, kSmallest, 1.0);
}

void ResolutionControl::measured(double scale, double ms) {
    if (!(ms > 0)) return;
    const double wanted = std::clamp(std::sqrt(target_ms_ / ms), 0.6, 1.2);
    scale_ = std::clamp(scale * wanted, kSmallest, 1.0);
}

}  // namespace darb
