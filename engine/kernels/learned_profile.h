// SPDX-License-Identifier: MIT
// A kernel whose profile training changes, one for the whole scene:
//   w(q) = sum_j p_j F_j(u), u = 1 - q/R^2, F_j(u) = sum_{k >= j} B_{k,n}(u), j = 1..n,
// with the Bernstein polynomials B_{k,n} of degree n = 6 and weights p > 0 of sum 1, the softmax of
// what is learned. Each F_j rises from 0 at the edge to 1 at the centre, and so does every w: the
// parameters cannot leave the set of kernels. R^2 follows from p so that psi, the second moment in
// space, stays that of the kernel at the start. Formulas: docs/math.md, A profile that is learned.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "engine/kernels/kernel_definition.h"
#include "engine/kernels/kernel_family.h"
#include "shaders/shared/profile_args.h"

namespace darb {

class LearnedProfile {
  public:
    /// n: w = u P(u) with P of degree 5, as short as that of built-in kernels. From n = 7 on, terms
    /// of P in q cancel by more than float32 may lose (KernelCoefficients).
    static constexpr int kWeights = 6;
    using Values = std::array<double, kWeights>;

    /// The profile nearest to a kernel, by least squares over u; its weights are at least
    /// kLeastWeight, so that each can grow. Throws Error where fault_of_start() has one.
    explicit LearnedProfile(int start);
    /// Why training cannot change the profile of this kernel; empty where it can.
    static std::string fault_of_start(int kernel);

    static constexpr double kLeastWeight = 1e-3;  // of the start

    int start() const { return start_; }
    /// The parameters; weights follow from them.
    const std::array<float, kWeights>& logits() const { return logits_; }
    void set_logits(const std::array<float, kWeights>& logits) { logits_ = logits; }

    Values weights() const;
    /// R^2 for these weights.
    double support() const;
    /// The drawn profile at q >= 0, as kernel_value; and its derivatives by the logits with q held,
    /// the path through R^2 included.
    double value(Footprint footprint, double q) const;
    Values by_logits(Footprint footprint, double q) const;
    /// dL/d(logits) from the sums that profile_gradient.comp leaves: sum over pixels and splats of
    /// opacity dL/dalpha T_k(2 sqrt(u) - 1), with T_k of Chebyshev. Exact, as dw/d(logit) is a
    /// polynomial of sqrt(u) of degree 2n + 1 with either footprint.
    Values gradient(Footprint footprint, std::span<const float> sums) const;

    /// A kernel of its own, as a user's: `learned_` and eight hexadecimal digits.
    KernelDefinition definition() const;
    /// The largest distance of w from the kernel that it started from, over the support of either.
    double distance_from_start() const;

  private:
    struct Parts;
    Parts parts() const;
    double drawn(const Parts& parts, Footprint footprint, double u) const;
    Values slopes(const Parts& parts, Footprint footprint, double u) const;

    int start_;
    double psi_;  // that stays
    std::array<float, kWeights> logits_{};
};

/// The weights p >= 0 of sum 1 for which sum_j p_j F_j is nearest to f in the mean square over u in
/// [0, 1].
LearnedProfile::Values nearest_weights(const std::function<double(double)>& f);

/// LearnedProfile with the optimizer that changes it: Adam on the logits, one step an update.
class ProfileOptimizer {
  public:
    /// rate: how far a step moves a logit.
    ProfileOptimizer(int start, Footprint footprint, double rate);

    const LearnedProfile& profile() const { return profile_; }
    /// The registered kernel of the profile as it is now.
    int kernel() const { return kernel_; }
    /// One step by the sums since the last one; without any, or where one is not finite, nothing
    /// changes. Takes about 30 ms, most of it for the new kernel's polynomials.
    void step(std::span<const float> sums);

    /// All that steps change, for checkpoints: kStateFloats numbers.
    std::vector<float> state() const;
    /// Throws Error for what state() does not give.
    void restore(const std::vector<float>& state);
    static constexpr std::size_t kStateFloats = 3 * LearnedProfile::kWeights + 1;

  private:
    Footprint footprint_;
    double rate_;
    LearnedProfile profile_;
    std::array<float, LearnedProfile::kWeights> first_{}, second_{};  // moments
    int steps_ = 0;
    int kernel_;
};

}  // namespace darb
