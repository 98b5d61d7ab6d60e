// float16 of files, as float32.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

namespace darb {

/// IEEE 754 binary16.
inline float half_to_float(std::uint16_t bits) {
    const int exponent = (bits >> 10) & 31, mantissa = bits & 1023;
    const double sign = bits & 0x8000 ? -1 : 1;
    if (exponent == 31) return static_cast<float>(mantissa ? NAN : sign * INFINITY);
    return static_cast<float>(exponent ? sign * std::ldexp(1024 + mantissa, exponent - 25)
                                       : sign * std::ldexp(mantissa, -24));
}

}  // namespace darb
