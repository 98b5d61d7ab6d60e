// SPDX-License-Identifier: MIT
// Seconds of the clock that the viewer paces itself by.
#pragma once

#include <chrono>

namespace darb {

inline double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace darb
