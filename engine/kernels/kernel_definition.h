// SPDX-License-Identifier: MIT
// A kernel as data: its profile w(q), given by a function, an expression or a table, and reduced to
// a short Chebyshev series that files can hold. register_kernel (kernel_registry.h) adds it to the
// family of kernels.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
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

// Kernels as people write them: a name, an expression, a file of their own.

/// A kernel by its name or as "expr: ...", which is registered; its notes are added to `notes`.
/// Throws Error that names `option` for what is no kernel, and for a name with more than one pulse.
int kernel_of_word(const std::string& option, const std::string& word,
                   std::vector<std::string>& notes);

/// The same for a word after --kernel, which must name one kernel alone.
int kernel_of_option(const std::string& word, std::vector<std::string>& notes);

/// Registers the kernels of a file, in its order. Throws Error that names the file.
std::vector<int> kernels_of_file(const std::filesystem::path& path,
                                 std::vector<std::string>& notes);

/// The names that --kernel takes, with commas: built in, read from files, with shapes.
std::string kernel_names();
/// Those whose shape each splat learns.
std::string shaped_kernel_names();

// Kernels in JSON files: {"name": ..., "support": ..., "expression": ...} or "table": [[q, w], ...]
// or "function": ..., or a list of these. "function" is what darb writes: a kernel in digested
// form, which needs neither expression nor table.

constexpr std::size_t kMostTableRows = 10'000, kMostKernelsOfFile = 100;

/// Makes a kernel from a table with q rising from 0 and w falling from its first value. In between
/// it is the cubic spline or, where that would grow, the monotone cubics of Fritsch and Carlson.
/// The support is the last q. Throws Error naming the row, counted from 1.
KernelDefinition kernel_from_table(std::string_view name,
                                   const std::vector<std::pair<double, double>>& rows,
                                   const std::string& where);

/// Throws Error naming the file and, where known, the row or the place in an expression. A single
/// kernel without a name takes that of the file.
std::vector<KernelDefinition> parse_kernel_file(std::string_view text, const std::string& where);
std::vector<KernelDefinition> read_kernel_file(const std::filesystem::path& path);

/// To and from the form of "function", which preserves same_kernel() and source.
/// definition_from_json throws Error at `where`.
nlohmann::json definition_json(const KernelDefinition& definition);
KernelDefinition definition_from_json(const nlohmann::json& json, const std::string& where);

}  // namespace darb
