// SPDX-License-Identifier: MIT
// The inner loops of the one-dimensional study: a sum of kernels on a row of samples, its squared
// error, and the gradient. Plain float arrays, which compilers vectorise.
#pragma once

#include <span>
#include <vector>

#include "engine/kernels/kernel_coefficients.h"
#include "tools/paper/approximate1d.h"

namespace darb {

/// samples points from -10 to 10, both included.
std::vector<float> sample_points_1d(int samples);

class Terms1d {
  public:
    Terms1d(int kernel, std::span<const float> target, std::size_t primitives);

    /// Whether the kernel can be used here: not with several pulses, nor where it falls to its edge
    /// as something else than a whole power up to the fourth.
    static bool draws(int kernel);

    /// Returns the mean squared error; gradient: [N][4] by position, log width, weight, log shape.
    double loss(std::span<const Primitive1d> primitives, std::vector<double>& gradient);

    /// After loss(): the sum of the terms minus the target.
    const std::vector<float>& residual() const { return residual_; }

  private:
    struct Reach {
        std::size_t first, last;  // range of samples that a primitive affects
    };
    Reach reach_of(const Primitive1d& p) const;
    void add_term(const Primitive1d& p, std::size_t i, const Reach& reach);

    int kernel_;
    KernelCoefficients coefficients_;  // the Gaussian's, for the generalised exponential
    double radius_;                    // radius of the support, in widths
    std::span<const float> target_;
    std::vector<float> x_, residual_;
    std::vector<float> w_, slope_z_, by_shape_;  // [N][samples]: w, dw/dq z, dw/dlog shape
};

}  // namespace darb
