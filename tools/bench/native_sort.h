// SPDX-License-Identifier: MIT
// Sort and scan in plain C++ on one thread, with which those of the device are compared.
#pragma once

#include <cstdint>
#include <vector>

namespace darb {

/// Stable, least significant digit first, 8 bits per pass. Temporaries are kept between calls.
class NativeSort {
  public:
    void sort(std::vector<std::uint32_t>& keys, std::vector<std::uint32_t>& values);

  private:
    std::vector<std::uint32_t> keys_, values_;
};

/// Exclusive prefix sum modulo 2^32.
void native_scan(const std::vector<std::uint32_t>& counts, std::vector<std::uint32_t>& offsets);

}  // namespace darb
