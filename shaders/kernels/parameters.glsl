// SPDX-License-Identifier: MIT
// What the arithmetic of a form depends on besides q, as engine/kernels derives it for each kernel. The functions of
// the forms take it by value: a kernel and the second one of a blend are two values, and both fold as constants do.
struct KernelParameters {
    int form;               // KERNEL_FORM_*
    int degree;             // degree of P
    int half_power;         // 2a of u^a, 2e of (1+q)^-e
    int squared_variable;   // 1: x = t^2 rather than t = q/R^2
    float support;          // R^2
    float inverse_support;  // rounded up: u <= 0 at the edge
    float c[KERNEL_MAX_DEGREE + 1];  // coefficients of P, rising powers; for RINGS: see its form
};
