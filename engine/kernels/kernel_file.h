// Kernels in JSON files: {"name": ..., "support": ..., "expression": ...} or "table": [[q, w], ...]
// or "function": ..., or a list of such. "function" is what darb writes: a digest of any of them
// that needs neither expression nor table.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "engine/kernels/kernel_definition.h"

namespace darb {

constexpr std::size_t kMostTableRows = 10'000, kMostKernelsOfFile = 100;

/// q rising from 0, w falling from its first value; between them the cubic spline, or where that
/// grows the cubics of Fritsch and Carlson, which do not. The support is the last q. Throws Error
/// that names the row, counted from 1.
KernelDefinition kernel_from_table(std::string_view name,
                                   const std::vector<std::pair<double, double>>& rows,
                                   const std::string& where);

/// Throws Error that names the file and, where there is one, the row or the place in an expression.
/// Kernels without a name take that of the file, where it is one.
std::vector<KernelDefinition> parse_kernel_file(std::string_view text, const std::string& where);
std::vector<KernelDefinition> read_kernel_file(const std::filesystem::path& path);

/// As "function" has it, and back: same_kernel() and source survive. definition_from_json throws
/// Error at `where`.
nlohmann::json definition_json(const KernelDefinition& definition);
KernelDefinition definition_from_json(const nlohmann::json& json, const std::string& where);

}  // namespace darb
