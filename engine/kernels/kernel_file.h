// SPDX-License-Identifier: MIT
// Kernels in JSON files: {"name": ..., "support": ..., "expression": ...} or "table": [[q, w], ...]
// or "function": ..., or a list of these. "function" is what darb writes: a kernel in digested
// form, which needs neither expression nor table.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "engine/kernels/kernel_definition.h"

namespace darb {

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
