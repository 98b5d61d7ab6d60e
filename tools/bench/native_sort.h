// Sort and scan in plain C++ on one thread: what the device's are held against.
#pragma once

#include <cstdint>
#include <vector>

namespace darb {

/// Stable, least significant digit first, 8 bits a pass; the temporaries are kept between calls.
class NativeSort {
  public:
    void sort(std::vector<std::uint32_t>& keys, std::vector<std::uint32_t>& values);

  private:
    std::vector<std::uint32_t> keys_, values_;
};

/// Exclusive prefix sum modulo 2^32.
void native_scan(const std::vector<std::uint32_t>& counts, std::vector<std::uint32_t>& offsets);

}  // namespace darb
