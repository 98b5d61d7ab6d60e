// SPDX-License-Identifier: MIT
// Infinite parameters that are meaningful, with one rule for all readers. A logit of +-infinity is
// an opacity of 1 or 0 (PLYs expanded from formats with one byte of opacity have it); a log
// scale of -infinity is a splat without extent on that axis. They are replaced by the limits to
// which the passes clamp them. NaN and every other infinity stay, and such splats are dropped.
#pragma once

#include <cmath>

#include "shaders/shared/limits.h"

namespace darb {

inline float limit_infinite_logit(float logit) {
    return std::isinf(logit) ? std::copysign(static_cast<float>(OPACITY_LOGIT_LIMIT), logit)
                             : logit;
}

inline float limit_infinite_log_scale(float log_scale) {
    return std::isinf(log_scale) && log_scale < 0 ? -static_cast<float>(LOG_SCALE_LIMIT)
                                                  : log_scale;
}

}  // namespace darb
