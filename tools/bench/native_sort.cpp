// SPDX-License-Identifier: MIT
#include "tools/bench/native_sort.h"

#include <array>
#include <numeric>

namespace darb {

void NativeSort::sort(std::vector<std::uint32_t>& keys, std::vector<std::uint32_t>& values) {
    const std::size_t n = keys.size();
    keys_.resize(n);
    values_.resize(n);
    std::array<std::array<std::uint32_t, 256>, 4> count{};  // counts all digits in one pass
    for (const std::uint32_t key : keys)
        for (std::size_t digit = 0; digit < 4; ++digit) ++count[digit][key >> (8 * digit) & 255u];
    for (std::size_t digit = 0; digit < 4; ++digit) {
        std::array<std::uint32_t, 256> next;
        std::exclusive_scan(count[digit].begin(), count[digit].end(), next.begin(), 0u);
        for (std::size_t i = 0; i < n; ++i) {
            const std::uint32_t at = next[keys[i] >> (8 * digit) & 255u]++;
            keys_[at] = keys[i];
            values_[at] = values[i];
        }
        keys.swap(keys_);
        values.swap(values_);
    }
}

void native_scan(const std::vector<std::uint32_t>& counts, std::vector<std::uint32_t>& offsets) {
    offsets.resize(counts.size());
    std::exclusive_scan(counts.begin(), counts.end(), offsets.begin(), 0u);
}

}  // namespace darb
