// P and dP/dx by Horner over the constants KERNEL_C*; folds to KERNEL_DEGREE and KERNEL_DEGREE - 1 steps.
// One step; the first one only starts the chain.
void polynomial_step(int power, float c, float x, inout float p, inout float dp) {
    if (power == KERNEL_DEGREE) {
        p = c;
        dp = 0.0;
    } else if (power == KERNEL_DEGREE - 1) {
        dp = p;
        p = p * x + c;
    } else if (power < KERNEL_DEGREE) {
        dp = dp * x + p;
        p = p * x + c;
    }
}

void kernel_polynomial(float x, out float p, out float dp) {
    p = KERNEL_C0;
    dp = 0.0;
    polynomial_step(8, KERNEL_C8, x, p, dp);
    polynomial_step(7, KERNEL_C7, x, p, dp);
    polynomial_step(6, KERNEL_C6, x, p, dp);
    polynomial_step(5, KERNEL_C5, x, p, dp);
    polynomial_step(4, KERNEL_C4, x, p, dp);
    polynomial_step(3, KERNEL_C3, x, p, dp);
    polynomial_step(2, KERNEL_C2, x, p, dp);
    polynomial_step(1, KERNEL_C1, x, p, dp);
    polynomial_step(0, KERNEL_C0, x, p, dp);
}
