// SPDX-License-Identifier: MIT
// Which splats are too transparent to be drawn by anybody.
#pragma once

namespace darb {

/// The opacity (of the sigmoid, 0 to 1) below which a splat is never drawn, where `cutoff` is the
/// least alpha that is blended. It is lower by more than an opacity in float32 may be off, which is
/// about 1e-6 of it.
constexpr double undrawn_below(double cutoff) {
    return cutoff * (1 - 1e-4);
}

}  // namespace darb
