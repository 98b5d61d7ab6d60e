// SPDX-License-Identifier: MIT
// Real spherical harmonics of degree 0-3 with the constants, order and signs of 3DGS.
// SH_DEGREE is a specialization constant of the including shader.

#include "shared/attribute_list.h"

const float SH_C1 = 0.4886025119029199;
const float SH_C2[5] = float[](1.0925484305920792, -1.0925484305920792, 0.31539156525252005,
                               -1.0925484305920792, 0.5462742152960396);
const float SH_C3[7] = float[](-0.5900435899266435, 2.890611442640554, -0.4570457994644658,
                               0.3731763325901154, -0.4570457994644658, 1.445305721320277,
                               -0.5900435899266435);
const int SH_REST_MAX = 15;

// basis[k] is the value of coefficient k+1 at the unit direction d; entries above SH_DEGREE are left unset.
void sh_basis(vec3 d, out float basis[SH_REST_MAX]) {
    const float x = d.x, y = d.y, z = d.z;
    if (SH_DEGREE >= 1) {
        basis[0] = -SH_C1 * y;
        basis[1] = SH_C1 * z;
        basis[2] = -SH_C1 * x;
    }
    if (SH_DEGREE >= 2) {
        basis[3] = SH_C2[0] * x * y;
        basis[4] = SH_C2[1] * y * z;
        basis[5] = SH_C2[2] * (2.0 * z * z - x * x - y * y);
        basis[6] = SH_C2[3] * x * z;
        basis[7] = SH_C2[4] * (x * x - y * y);
    }
    if (SH_DEGREE >= 3) {
        basis[8] = SH_C3[0] * y * (3.0 * x * x - y * y);
        basis[9] = SH_C3[1] * x * y * z;
        basis[10] = SH_C3[2] * y * (4.0 * z * z - x * x - y * y);
        basis[11] = SH_C3[3] * z * (2.0 * z * z - 3.0 * x * x - 3.0 * y * y);
        basis[12] = SH_C3[4] * x * (4.0 * z * z - x * x - y * y);
        basis[13] = SH_C3[5] * z * (x * x - y * y);
        basis[14] = SH_C3[6] * x * (x * x - 3.0 * y * y);
    }
}

// The gradient of sum_k c[k] * basis[k] with respect to d, as if d were free (not normalised).
vec3 sh_direction_gradient(vec3 d, const float c[SH_REST_MAX]) {
    const float x = d.x, y = d.y, z = d.z;
    vec3 g = vec3(0.0);
    if (SH_DEGREE >= 1) g += vec3(-SH_C1 * c[2], -SH_C1 * c[0], SH_C1 * c[1]);
    if (SH_DEGREE >= 2) {
        g.x += SH_C2[0] * y * c[3] - SH_C2[2] * 2.0 * x * c[5] + SH_C2[3] * z * c[6] +
               SH_C2[4] * 2.0 * x * c[7];
        g.y += SH_C2[0] * x * c[3] + SH_C2[1] * z * c[4] - SH_C2[2] * 2.0 * y * c[5] -
               SH_C2[4] * 2.0 * y * c[7];
        g.z += SH_C2[1] * y * c[4] + SH_C2[2] * 4.0 * z * c[5] + SH_C2[3] * x * c[6];
    }
    if (SH_DEGREE >= 3) {
        const float xx = x * x, yy = y * y, zz = z * z;
        g.x += SH_C3[0] * 6.0 * x * y * c[8] + SH_C3[1] * y * z * c[9] -
               SH_C3[2] * 2.0 * x * y * c[10] - SH_C3[3] * 6.0 * x * z * c[11] +
               SH_C3[4] * (4.0 * zz - 3.0 * xx - yy) * c[12] + SH_C3[5] * 2.0 * x * z * c[13] +
               SH_C3[6] * 3.0 * (xx - yy) * c[14];
        g.y += SH_C3[0] * 3.0 * (xx - yy) * c[8] + SH_C3[1] * x * z * c[9] +
               SH_C3[2] * (4.0 * zz - xx - 3.0 * yy) * c[10] - SH_C3[3] * 6.0 * y * z * c[11] -
               SH_C3[4] * 2.0 * x * y * c[12] - SH_C3[5] * 2.0 * y * z * c[13] -
               SH_C3[6] * 6.0 * x * y * c[14];
        g.z += SH_C3[1] * x * y * c[9] + SH_C3[2] * 8.0 * y * z * c[10] +
               SH_C3[3] * (6.0 * zz - 3.0 * xx - 3.0 * yy) * c[11] +
               SH_C3[4] * 8.0 * x * z * c[12] + SH_C3[5] * (xx - yy) * c[13];
    }
    return g;
}
