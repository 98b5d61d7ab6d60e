// SPDX-License-Identifier: MIT
#include "trainer/options/memory_size.h"

#include <cmath>
#include <cstdlib>

#include "engine/core/text.h"

namespace darb {

namespace {

/// Bytes for each unit that sizes have, powers of 1,000, with an i of 1,024.
std::optional<double> unit_bytes(std::string unit) {
    unit = lower(unit);
    if (unit.ends_with('b')) unit.pop_back();
    const bool binary = unit.ends_with('i');
    if (binary) unit.pop_back();
    if (unit.empty()) return binary ? std::nullopt : std::optional<double>(1);
    const std::size_t power = std::string("kmgt").find(unit);
    if (unit.size() != 1 || power == std::string::npos) return std::nullopt;
    return std::pow(binary ? 1024.0 : 1000.0, static_cast<double>(power + 1));
}

}  // namespace

std::optional<double> parse_bytes(const std::string& text) {
    char* end = nullptr;
    const double number = std::strtod(text.c_str(), &end);
    if (end == text.c_str()) return std::nullopt;
    std::string unit(end);
    unit.erase(0, unit.find_first_not_of(' '));
    const std::optional<double> bytes = unit_bytes(unit);
    if (!bytes) return std::nullopt;
    return number * *bytes;
}

}  // namespace darb
