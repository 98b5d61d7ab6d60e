// SPDX-License-Identifier: MIT
// P and dP/dx by Horner; folds to `degree` and `degree` - 1 steps.
// One step; the first one only starts the chain.
void polynomial_step(const KernelParameters k, int power, float x, inout float p, inout float dp) {
    if (power == k.degree) {
        p = k.c[power];
        dp = 0.0;
    } else if (power == k.degree - 1) {
        dp = p;
        p = p * x + k.c[power];
    } else if (power < k.degree) {
        dp = dp * x + p;
        p = p * x + k.c[power];
    }
}

void kernel_polynomial(const KernelParameters k, float x, out float p, out float dp) {
    p = k.c[0];
    dp = 0.0;
    polynomial_step(k, 8, x, p, dp);
    polynomial_step(k, 7, x, p, dp);
    polynomial_step(k, 6, x, p, dp);
    polynomial_step(k, 5, x, p, dp);
    polynomial_step(k, 4, x, p, dp);
    polynomial_step(k, 3, x, p, dp);
    polynomial_step(k, 2, x, p, dp);
    polynomial_step(k, 1, x, p, dp);
    polynomial_step(k, 0, x, p, dp);
}
