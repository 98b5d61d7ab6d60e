// SPDX-License-Identifier: MIT
#include "engine/gpu/faults.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <utility>

#include "engine/core/error.h"

namespace darb {

namespace {

constexpr std::uint64_t kMaxBits = 64;

// The number behind "NAME:"; nothing where the text is of another fault or no number.
std::optional<std::uint64_t> number_of(std::string_view text, std::string_view name) {
    if (!text.starts_with(name)) return std::nullopt;
    const std::string_view number = text.substr(name.size());
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), value);
    const bool whole = error == std::errc() && end == number.data() + number.size();
    return whole ? std::optional(value) : std::nullopt;
}

void parse_one(std::string_view text, Faults& faults) {
    constexpr std::string_view kOom = "oom:";
    if (text.starts_with(kOom) && text.size() > kOom.size()) {
        faults.out_of_memory.emplace_back(text.substr(kOom.size()));
        return;
    }
    const std::pair<std::string_view, bool*> switches[] = {
        {"discrete", &faults.discrete},
        {"no_half", &faults.no_half},
        {"own_subgroups", &faults.own_subgroups}};
    for (const auto& [name, value] : switches)
        if (text == name) {
            *value = true;
            return;
        }
    const std::pair<std::string_view, std::uint64_t*> counts[] = {
        {"lost:", &faults.lost_at_submit},         {"binding:", &faults.binding_bytes},
        {"allocation:", &faults.allocation_bytes}, {"allocations:", &faults.allocations},
        {"buffers:", &faults.storage_buffers},     {"memory:", &faults.memory_bytes}};
    for (const auto& [name, value] : counts)
        if (const auto number = number_of(text, name); number.value_or(0) > 0) {
            *value = *number;
            return;
        }
    if (const auto bits = number_of(text, "timestamps:"); bits.value_or(kMaxBits + 1) <= kMaxBits) {
        faults.timestamp_bits = static_cast<std::uint32_t>(*bits);
        return;
    }
    throw Error(
        "DARB_FAULT", "\"" + std::string(text) + "\" is no fault",
        "Write oom:BUFFER, lost:N, binding:N, allocation:N, allocations:N, buffers:N, "
        "memory:N, timestamps:BITS, own_subgroups, no_half or discrete, separated by commas, "
        "or "
        "unset it.");
}

}  // namespace

bool Faults::fails_allocation(std::string_view buffer, std::uint64_t in_all) const {
    return (memory_bytes != 0 && in_all > memory_bytes) ||
           std::find(out_of_memory.begin(), out_of_memory.end(), buffer) != out_of_memory.end();
}

Faults parse_faults(std::string_view text) {
    Faults faults;
    while (!text.empty()) {
        const size_t comma = std::min(text.find(','), text.size());
        parse_one(text.substr(0, comma), faults);
        text.remove_prefix(std::min(comma + 1, text.size()));
    }
    return faults;
}

}  // namespace darb
