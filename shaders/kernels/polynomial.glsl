// SPDX-License-Identifier: MIT
// P and dP/dx by Horner's scheme; it folds to `degree` and `degree` - 1 steps.
// This is one step; the first one only starts the chain.
void polynomial_step(int degree, int power, float c, float x, inout float p, inout float dp) {
    if (power == degree) {
        p = c;
        dp = 0.0;
    } else if (power == degree - 1) {
        dp = p;
        p = p * x + c;
    } else if (power < degree) {
        dp = dp * x + p;
        p = p * x + c;
    }
}

void kernel_polynomial(const KernelParameters k, float x, out float p, out float dp) {
    p = k.c[0];
    dp = 0.0;
    polynomial_step(k.degree, 8, k.c[8], x, p, dp);
    polynomial_step(k.degree, 7, k.c[7], x, p, dp);
    polynomial_step(k.degree, 6, k.c[6], x, p, dp);
    polynomial_step(k.degree, 5, k.c[5], x, p, dp);
    polynomial_step(k.degree, 4, k.c[4], x, p, dp);
    polynomial_step(k.degree, 3, k.c[3], x, p, dp);
    polynomial_step(k.degree, 2, k.c[2], x, p, dp);
    polynomial_step(k.degree, 1, k.c[1], x, p, dp);
    polynomial_step(k.degree, 0, k.c[0], x, p, dp);
}
