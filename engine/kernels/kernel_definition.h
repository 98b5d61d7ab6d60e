// A kernel as data: its profile w(q) given by a function, an expression or a table, and reduced to
// a short Chebyshev series that files can hold. register_kernel (kernel_registry.h) makes a kernel
// of the family of it.
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
    int like = -1;                   // KERNEL_* whose profile, cut at support, it is: gaussian,
                                     // inverse_quadratic, inverse_multiquadric; -1: the series
    int edge_order = 0;              // m of the zero at the edge, 0 to kMostEdgeOrder
    std::vector<double> series;      // w = u^m sum_k series[k] T_k(2u - 1), u = 1 - q / support
    std::string source;              // what it was made from, a line of text
    double error = 0;                // largest distance of the profile of source from the series
    std::vector<std::string> notes;  // what its maker should be told

    /// Of what is drawn: all but source, error and notes.
    bool same_kernel(const KernelDefinition& other) const;
};

constexpr int kMostEdgeOrder = 4;
constexpr std::size_t kMostSeriesTerms = 64, kMostNameLength = 40;
constexpr double kLeastSupport = 1e-2, kMostSupport = 1e4;
/// A profile that no u^m P(u) of KERNEL_MAX_DEGREE comes as near to is refused: a step of an 8-bit
/// picture at full opacity.
constexpr double kWorstFit = 4e-3;

/// What is wrong with a profile: reason, hint, and the q where it is.
struct ProfileFault : Error {
    ProfileFault(std::string reason_, std::string hint_, double q_)
        : Error("kernel", std::move(reason_), std::move(hint_)), q(q_) {}
    double q;
};

/// Any profile: w(q) for q in (0, support); it need not be defined at 0, where it has its limit.
/// Divided by w(0), with a note, where that is not 1. Where no polynomial of the shaders' degrees
/// reaches their float accuracy, the nearest one takes its place, with a note and its error.
/// support may be infinity for exp(-q/2). An empty name becomes one that a digest of the kernel
/// makes. Throws ProfileFault where w is infinite, negative, growing, 0 inside the support, or no
/// smooth function of q. Some 10 ms.
KernelDefinition define_kernel(std::string_view name, double support,
                               const std::function<double(double)>& w, std::string source);

/// Throws ProfileFault for a definition that define_kernel does not make: what a file holds.
void check_definition(const KernelDefinition& definition);
/// Why this is no name of a kernel of one's own; empty where it is one.
std::string fault_of_kernel_name(std::string_view name);
/// The row of a definition that has been checked; its name is a view of definition.name.
KernelProfile profile_of(const KernelDefinition& definition);

}  // namespace darb
