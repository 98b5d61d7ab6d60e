// Timestamps: query pools that grow with the number of passes of a recording. Private to
// engine/gpu.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <vector>

namespace darb {

/// Ticks between two values of a counter of which the lowest `bits` (1 to 64) are valid.
constexpr std::uint64_t tick_difference(std::uint64_t from, std::uint64_t to, std::uint32_t bits) {
    return (to - from) & (bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1);
}

class Timestamps {
  public:
    explicit Timestamps(VkDevice device) : device_(device) {}
    ~Timestamps();
    Timestamps(const Timestamps&) = delete;
    Timestamps& operator=(const Timestamps&) = delete;

    void restart() { count_ = 0; }
    /// Writes a timestamp once all earlier commands are done.
    void write(VkCommandBuffer commands);
    /// The ticks of all timestamps since restart(); the recording must have run.
    std::vector<std::uint64_t> read() const;

  private:
    VkDevice device_;
    std::vector<VkQueryPool> pools_;
    std::uint32_t count_ = 0;
};

}  // namespace darb
