// Kernels as text: "expr: (1 - q/9)^3, support 9, name cubic". Expressions are muParser's, in
// q = d^2 and d, with pi; without that library the build knows none and says so.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "engine/kernels/kernel_definition.h"

namespace darb {

/// Whether this build reads expressions.
bool has_expressions();

constexpr std::size_t kMostExpressionLength = 1000;

/// A list of kernels, split at the commas outside of brackets: names, and definitions that begin
/// with "expr:" and take the items "support NUMBER" and "name NAME" behind them as their own.
/// Blanks around items are dropped.
std::vector<std::string> split_kernel_list(std::string_view list);
bool is_kernel_expression(std::string_view item);

/// Of an item of such a list. Throws Error at `where`, with the text and a line of carets below the
/// place, for what muParser cannot read and for a profile that is no kernel's.
KernelDefinition kernel_from_expression(std::string_view item, const std::string& where);
/// The same where expression, support and name stand apart; support infinity: only the Gaussian.
KernelDefinition kernel_from_expression(const std::string& expression, double support,
                                        const std::string& name, const std::string& where);

/// Two more lines of an error: the text, of which a part around the place is shown, and carets
/// below its characters [begin, begin + length).
std::string with_carets(std::string_view text, std::size_t begin, std::size_t length);

}  // namespace darb
