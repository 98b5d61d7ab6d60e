// SPDX-License-Identifier: MIT
// A kernel as data: its profile w(q), given by a function, an expression or a table, and reduced to
// a short Chebyshev series that files can hold. register_kernel (kernel_registry.h) adds it to the
// family of kernels.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/core/error.h"
#include "engine/kernels/kernel_profile.h"

namespace darb {

struct KernelDefinition {
    std::string name;                // a small letter, then small letters, digits and _; 40 at most
    double support = 0;              // R^2 in q; infinity: the Gaussian
    int like = -1;                   // KERNEL_* whose profile, cut at the support, this is:
                                     // gaussian, inverse_quadratic, inverse_multiquadric; -1: the
                                     // series
    int edge_order = 0;              // order m of the zero at the edge, 0 to kMostEdgeOrder
    std::vector<double> series;      // w = u^m sum_k series[k] T_k(2u - 1), u = 1 - q / support
    std::string source;              // what it was made from, one line of text
    double error = 0;                // largest distance of the source's profile from the series
    std::vector<std::string> notes;  // what its author should be told

    /// Whether both are drawn alike: compares everything but source, error and notes.
    bool same_kernel(const KernelDefinition& other) const;
};

constexpr int kMostEdgeOrder = 4;
constexpr std::size_t kMostSeriesTerms = 64, kMostNameLength = 40;
constexpr double kLeastSupport = 1e-2, kMostSupport = 1e4;
/// A profile is refused where no u^m P(u) up to KERNEL_MAX_DEGREE comes this close: one step of an
/// 8-bit picture at full opacity.
constexpr double kWorstFit = 4e-3;

/// What is wrong with a profile: reason, hint, and the q at which it is wrong.
struct ProfileFault : Error {
    ProfileFault(std::string reason_, std::string hint_, double q_)
        : Error("kernel", std::move(reason_), std::move(hint_)), q(q_) {}
    double q;
};

/// Makes a kernel from any profile: w(q) for q in (0, support). w need not be defined at 0, where
/// its limit is taken. It is divided by w(0), with a note, where that is not 1. Where no
/// polynomial of the shaders' degrees is accurate to float rounding, the nearest one is used, with
/// a note on its error. support may be infinity for exp(-q/2). An empty name becomes one made from
/// a digest of the kernel. Throws ProfileFault where w is infinite, negative, growing, 0 inside the
/// support, or not a smooth function of q. Takes about 10 ms.
KernelDefinition define_kernel(std::string_view name, double support,
                               const std::function<double(double)>& w, std::string source);

/// Throws ProfileFault for a definition that define_kernel would not make; for content of files.
void check_definition(const KernelDefinition& definition);
/// Why this cannot be the name of a user's own kernel; empty where it can.
std::string fault_of_kernel_name(std::string_view name);
/// The table row of a checked definition; its name is a view of definition.name.
KernelProfile profile_of(const KernelDefinition& definition);

}  // namespace darb
