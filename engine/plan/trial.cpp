#include "engine/plan/trial.h"

#include <fmt/format.h>

namespace darb {

std::string Trial::advice() const {
    const std::string measured =
        fmt::format("{:+.2f} dB on held-out photos for {:+.0f} % of time", gain_db(), 100 * price);
    return pays() ? fmt::format("{}: train with {}", measured, tried)
                  : fmt::format("{}: stay with {}; less than {} dB may be chance", measured, usual,
                                kLeastGain_db);
}

}  // namespace darb
