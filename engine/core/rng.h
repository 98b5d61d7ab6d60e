// SPDX-License-Identifier: MIT
// Pcg32 (O'Neill 2014, XSH-RR 64/32): small, seedable, and with equal numbers on every platform.
#pragma once

#include <cmath>
#include <cstdint>

namespace darb {

class Pcg32 {
  public:
    explicit Pcg32(std::uint64_t seed, std::uint64_t stream = 0) : increment_(stream * 2 + 1) {
        next();
        state_ += seed;
        next();
    }
    std::uint32_t next() {
        const std::uint64_t old = state_;
        state_ = old * 6364136223846793005ULL + increment_;
        const auto shifted = static_cast<std::uint32_t>(((old >> 18) ^ old) >> 27);
        const auto rotation = static_cast<std::uint32_t>(old >> 59);
        return (shifted >> rotation) | (shifted << ((32 - rotation) & 31));
    }
    /// Uniform in [0, 1), with 32 random bits.
    double uniform() { return next() * 0x1p-32; }
    double uniform(double low, double high) { return low + (high - low) * uniform(); }
    /// Uniform in [0, bound); bound > 0.
    std::uint32_t below(std::uint32_t bound) {
        return static_cast<std::uint32_t>((std::uint64_t{next()} * bound) >> 32);
    }
    /// Standard normal, by Box-Muller.
    double normal() {
        const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
        return radius * std::cos(6.283185307179586 * uniform());
    }
    std::uint64_t state() const { return state_; }
    void set_state(std::uint64_t state) { state_ = state; }

  private:
    std::uint64_t state_ = 0;
    std::uint64_t increment_;
};

}  // namespace darb
