// SPDX-License-Identifier: MIT
// Kernels as text: "expr: (1 - q/9)^3, support 9, name cubic". Expressions are those of muParser,
// in q = d^2 and d, with pi. A build without that library refuses them and says so.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "engine/kernels/kernel_definition.h"

namespace darb {

/// Whether this build can read expressions.
bool has_expressions();

constexpr std::size_t kMostExpressionLength = 1000;

/// Splits a list of kernels at commas outside brackets. Its items are names, and definitions that
/// begin with "expr:" and include the items "support NUMBER" and "name NAME" that follow them.
/// Blanks around items are dropped.
std::vector<std::string> split_kernel_list(std::string_view list);
bool is_kernel_expression(std::string_view item);

/// Makes the kernel of an item that begins with "expr:". Throws Error at `where` for what muParser
/// cannot read, with the text and carets below the place, and for a profile that cannot be a
/// kernel's.
KernelDefinition kernel_from_expression(std::string_view item, const std::string& where);
/// As above, with expression, support and name given separately. support infinity: only the
/// Gaussian.
KernelDefinition kernel_from_expression(const std::string& expression, double support,
                                        const std::string& name, const std::string& where);

/// Two more lines for an error: the part of the text around the place, and carets below its
/// characters [begin, begin + length).
std::string with_carets(std::string_view text, std::size_t begin, std::size_t length);

}  // namespace darb
