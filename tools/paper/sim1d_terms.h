// The inner loops of the one-dimensional study: a sum of kernels on a row of samples, its squared
// error and the gradient. Plain float arrays, which compilers vectorise.
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

    /// Whether the kernel has a profile here: one of several pulses has none, nor one that falls
    /// to its edge as no whole power up to the fourth.
    static bool draws(int kernel);

    /// Mean squared error; gradient [N][4] by position, log width, weight, log shape.
    double loss(std::span<const Primitive1d> primitives, std::vector<double>& gradient);

    /// The sum of the terms less the target, after loss().
    const std::vector<float>& residual() const { return residual_; }

  private:
    struct Reach {
        std::size_t first, last;  // samples that a primitive can touch
    };
    Reach reach_of(const Primitive1d& p) const;
    void add_term(const Primitive1d& p, std::size_t i, const Reach& reach);

    int kernel_;
    KernelCoefficients coefficients_;  // for the generalised exponential the Gaussian's
    double radius_;                    // of the support, in widths
    std::span<const float> target_;
    std::vector<float> x_, residual_;
    std::vector<float> w_, slope_z_, by_shape_;  // [N][samples]: w, dw/dq z, dw/dlog shape
};

}  // namespace darb
