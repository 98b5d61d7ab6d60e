#include "engine/gpu/faults.h"

#include <algorithm>
#include <charconv>
#include <utility>

#include "engine/core/error.h"

namespace darb {

namespace {

void parse_one(std::string_view text, Faults& faults) {
    constexpr std::string_view kOom = "oom:", kLost = "lost:", kBinding = "binding:",
                               kAllocation = "allocation:", kMemory = "memory:";
    if (text.starts_with(kOom) && text.size() > kOom.size()) {
        faults.out_of_memory.emplace_back(text.substr(kOom.size()));
        return;
    }
    for (const auto& [name, value] :
         {std::pair{kLost, &faults.lost_at_submit}, std::pair{kBinding, &faults.binding_bytes},
          std::pair{kAllocation, &faults.allocation_bytes},
          std::pair{kMemory, &faults.memory_bytes}}) {
        if (!text.starts_with(name)) continue;
        const std::string_view number = text.substr(name.size());
        const auto [end, error] =
            std::from_chars(number.data(), number.data() + number.size(), *value);
        const bool whole = end == number.data() + number.size();
        if (error == std::errc() && whole && *value > 0) return;
    }
    throw Error("DARB_FAULT", "\"" + std::string(text) + "\" is no fault",
                "Write oom:BUFFER, lost:N, binding:N, allocation:N or memory:N, separated by "
                "commas, or unset it.");
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
