#include "engine/reference/sh.h"

namespace darb::reference {
template <class T>
ShBasis<T> sh_basis(int degree, const Vec3<T>& direction) {
    return darb::sh_basis(degree, direction.x, direction.y, direction.z);
}

template <class T>
ShBasisGradient<T> sh_basis_gradient(int degree, const Vec3<T>& direction) {
    const T x = direction.x, y = direction.y, z = direction.z;
    const T xx = x * x, yy = y * y, zz = z * z;
    ShBasisGradient<T> g{};
    if (degree >= 1) {
        g[1].y = -T(kShBand1);
        g[2].z = T(kShBand1);
        g[3].x = -T(kShBand1);
    }
    if (degree >= 2) {
        g[4] = T(kShBand2Xy) * Vec3<T>(y, x, 0);
        g[5] = -T(kShBand2Xy) * Vec3<T>(0, z, y);
        g[6] = T(kShBand2Zz) * Vec3<T>(-2 * x, -2 * y, 4 * z);
        g[7] = -T(kShBand2Xy) * Vec3<T>(z, 0, x);
        g[8] = T(kShBand2Xx) * Vec3<T>(2 * x, -2 * y, 0);
    }
    if (degree >= 3) {
        g[9] = -T(kShBand3Three) * Vec3<T>(6 * x * y, 3 * xx - 3 * yy, 0);
        g[10] = T(kShBand3Xyz) * Vec3<T>(y * z, x * z, x * y);
        g[11] = -T(kShBand3One) * Vec3<T>(-2 * x * y, 4 * zz - xx - 3 * yy, 8 * y * z);
        g[12] = T(kShBand3Zero) * Vec3<T>(-6 * x * z, -6 * y * z, 6 * zz - 3 * xx - 3 * yy);
        g[13] = -T(kShBand3One) * Vec3<T>(4 * zz - 3 * xx - yy, -2 * x * y, 8 * x * z);
        g[14] = T(kShBand3Two) * Vec3<T>(2 * x * z, -2 * y * z, xx - yy);
        g[15] = -T(kShBand3Three) * Vec3<T>(3 * xx - 3 * yy, -6 * x * y, 0);
    }
    return g;
}

template ShBasis<double> sh_basis(int, const Vec3<double>&);
template ShBasis<float> sh_basis(int, const Vec3<float>&);
template ShBasisGradient<double> sh_basis_gradient(int, const Vec3<double>&);
template ShBasisGradient<float> sh_basis_gradient(int, const Vec3<float>&);

}  // namespace darb::reference
