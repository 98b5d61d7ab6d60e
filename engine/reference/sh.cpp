#include "engine/reference/sh.h"

namespace darb::reference {
namespace {

// Normalisation of the real harmonics; the signs are 3DGS's (Condon-Shortley phase kept).
constexpr double kBand0 = 0.28209479177387814;      // sqrt(1 / pi) / 2
constexpr double kBand1 = 0.4886025119029199;       // sqrt(3 / pi) / 2
constexpr double kBand2Xy = 1.0925484305920792;     // sqrt(15 / pi) / 2
constexpr double kBand2Zz = 0.31539156525252005;    // sqrt(5 / pi) / 4
constexpr double kBand2Xx = 0.5462742152960396;     // sqrt(15 / pi) / 4
constexpr double kBand3Three = 0.5900435899266435;  // sqrt(35 / (2 pi)) / 4
constexpr double kBand3Xyz = 2.890611442640554;     // sqrt(105 / pi) / 2
constexpr double kBand3One = 0.4570457994644658;    // sqrt(21 / (2 pi)) / 4
constexpr double kBand3Zero = 0.3731763325901154;   // sqrt(7 / pi) / 4
constexpr double kBand3Two = 1.445305721320277;     // sqrt(105 / pi) / 4

}  // namespace

template <class T>
ShBasis<T> sh_basis(int degree, const Vec3<T>& direction) {
    const T x = direction.x, y = direction.y, z = direction.z;
    const T xx = x * x, yy = y * y, zz = z * z;
    ShBasis<T> b{};
    b[0] = T(kBand0);
    if (degree >= 1) {
        b[1] = -T(kBand1) * y;
        b[2] = T(kBand1) * z;
        b[3] = -T(kBand1) * x;
    }
    if (degree >= 2) {
        b[4] = T(kBand2Xy) * x * y;
        b[5] = -T(kBand2Xy) * y * z;
        b[6] = T(kBand2Zz) * (2 * zz - xx - yy);
        b[7] = -T(kBand2Xy) * x * z;
        b[8] = T(kBand2Xx) * (xx - yy);
    }
    if (degree >= 3) {
        b[9] = -T(kBand3Three) * y * (3 * xx - yy);
        b[10] = T(kBand3Xyz) * x * y * z;
        b[11] = -T(kBand3One) * y * (4 * zz - xx - yy);
        b[12] = T(kBand3Zero) * z * (2 * zz - 3 * xx - 3 * yy);
        b[13] = -T(kBand3One) * x * (4 * zz - xx - yy);
        b[14] = T(kBand3Two) * z * (xx - yy);
        b[15] = -T(kBand3Three) * x * (xx - 3 * yy);
    }
    return b;
}

template <class T>
ShBasisGradient<T> sh_basis_gradient(int degree, const Vec3<T>& direction) {
    const T x = direction.x, y = direction.y, z = direction.z;
    const T xx = x * x, yy = y * y, zz = z * z;
    ShBasisGradient<T> g{};
    if (degree >= 1) {
        g[1].y = -T(kBand1);
        g[2].z = T(kBand1);
        g[3].x = -T(kBand1);
    }
    if (degree >= 2) {
        g[4] = T(kBand2Xy) * Vec3<T>(y, x, 0);
        g[5] = -T(kBand2Xy) * Vec3<T>(0, z, y);
        g[6] = T(kBand2Zz) * Vec3<T>(-2 * x, -2 * y, 4 * z);
        g[7] = -T(kBand2Xy) * Vec3<T>(z, 0, x);
        g[8] = T(kBand2Xx) * Vec3<T>(2 * x, -2 * y, 0);
    }
    if (degree >= 3) {
        g[9] = -T(kBand3Three) * Vec3<T>(6 * x * y, 3 * xx - 3 * yy, 0);
        g[10] = T(kBand3Xyz) * Vec3<T>(y * z, x * z, x * y);
        g[11] = -T(kBand3One) * Vec3<T>(-2 * x * y, 4 * zz - xx - 3 * yy, 8 * y * z);
        g[12] = T(kBand3Zero) * Vec3<T>(-6 * x * z, -6 * y * z, 6 * zz - 3 * xx - 3 * yy);
        g[13] = -T(kBand3One) * Vec3<T>(4 * zz - 3 * xx - yy, -2 * x * y, 8 * x * z);
        g[14] = T(kBand3Two) * Vec3<T>(2 * x * z, -2 * y * z, xx - yy);
        g[15] = -T(kBand3Three) * Vec3<T>(3 * xx - 3 * yy, -6 * x * y, 0);
    }
    return g;
}

template ShBasis<double> sh_basis(int, const Vec3<double>&);
template ShBasis<float> sh_basis(int, const Vec3<float>&);
template ShBasisGradient<double> sh_basis_gradient(int, const Vec3<double>&);
template ShBasisGradient<float> sh_basis_gradient(int, const Vec3<float>&);

}  // namespace darb::reference
