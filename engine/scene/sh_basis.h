// SPDX-License-Identifier: MIT
// Real spherical harmonics of degree 0 to 3 in the order and with the signs of 3DGS.
#pragma once

#include <array>

#include "shaders/shared/attribute_list.h"

namespace darb {

constexpr int kMaxShDegree = 3;
constexpr int kMaxShCoefficients = 16;  // (3 + 1)^2

// Normalisation of the real harmonics; the signs are 3DGS's (Condon-Shortley phase kept).
constexpr double kShBand0 = SH_C0;                    // sqrt(1 / pi) / 2
constexpr double kShBand1 = 0.4886025119029199;       // sqrt(3 / pi) / 2
constexpr double kShBand2Xy = 1.0925484305920792;     // sqrt(15 / pi) / 2
constexpr double kShBand2Zz = 0.31539156525252005;    // sqrt(5 / pi) / 4
constexpr double kShBand2Xx = 0.5462742152960396;     // sqrt(15 / pi) / 4
constexpr double kShBand3Three = 0.5900435899266435;  // sqrt(35 / (2 pi)) / 4
constexpr double kShBand3Xyz = 2.890611442640554;     // sqrt(105 / pi) / 2
constexpr double kShBand3One = 0.4570457994644658;    // sqrt(21 / (2 pi)) / 4
constexpr double kShBand3Zero = 0.3731763325901154;   // sqrt(7 / pi) / 4
constexpr double kShBand3Two = 1.445305721320277;     // sqrt(105 / pi) / 4

/// basis[k] for k < (degree + 1)^2, 0 beyond; (x, y, z) is of unit length. Colour before the clamp
/// is 0.5 + sum over k of basis[k] * coefficient[k].
template <class T>
std::array<T, kMaxShCoefficients> sh_basis(int degree, T x, T y, T z) {
    const T xx = x * x, yy = y * y, zz = z * z;
    std::array<T, kMaxShCoefficients> b{};
    b[0] = T(kShBand0);
    if (degree >= 1) {
        b[1] = -T(kShBand1) * y;
        b[2] = T(kShBand1) * z;
        b[3] = -T(kShBand1) * x;
    }
    if (degree >= 2) {
        b[4] = T(kShBand2Xy) * x * y;
        b[5] = -T(kShBand2Xy) * y * z;
        b[6] = T(kShBand2Zz) * (2 * zz - xx - yy);
        b[7] = -T(kShBand2Xy) * x * z;
        b[8] = T(kShBand2Xx) * (xx - yy);
    }
    if (degree >= 3) {
        b[9] = -T(kShBand3Three) * y * (3 * xx - yy);
        b[10] = T(kShBand3Xyz) * x * y * z;
        b[11] = -T(kShBand3One) * y * (4 * zz - xx - yy);
        b[12] = T(kShBand3Zero) * z * (2 * zz - 3 * xx - 3 * yy);
        b[13] = -T(kShBand3One) * x * (4 * zz - xx - yy);
        b[14] = T(kShBand3Two) * z * (xx - yy);
        b[15] = -T(kShBand3Three) * x * (xx - 3 * yy);
    }
    return b;
}

}  // namespace darb
