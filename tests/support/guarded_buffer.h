// SPDX-License-Identifier: MIT
// GuardedBuffer: device memory between guard words, poisoned until it is written, so that a test
// sees what a pass writes outside its bounds and what it leaves unwritten.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <vector>

#include "engine/gpu/buffer.h"

namespace darb::test {

constexpr std::uint32_t kPoison = 0xdeadbeef;

class GuardedBuffer {
  public:
    /// bytes: a multiple of 4.
    GuardedBuffer(Device& device, const std::string& name, std::uint64_t bytes)
        : buffer_(device, name, bytes + 2 * kGuardBytes), bytes_(bytes) {
        buffer_.upload(std::vector<std::uint32_t>((bytes + 2 * kGuardBytes) / 4, kPoison));
    }
    template <class T>
    GuardedBuffer(Device& device, const std::string& name, const std::vector<T>& values)
        : GuardedBuffer(device, name, values.size() * sizeof(T)) {
        write(values);
    }

    /// Reaches to the end of the buffer, guard words included, so that an access outside is a real
    /// one, not clamped.
    operator BufferRange() const { return {buffer_, kGuardBytes}; }
    const Buffer& buffer() const { return buffer_; }
    static constexpr std::uint64_t offset() { return kGuardBytes; }

    template <class T>
    void write(const std::vector<T>& values) {
        if (!values.empty()) buffer_.upload(values, kGuardBytes);
    }
    template <class T>
    std::vector<T> read() const {
        return buffer_.download<T>(bytes_ / sizeof(T), kGuardBytes);
    }
    testing::AssertionResult intact() const {
        for (const std::uint64_t at : {std::uint64_t{0}, kGuardBytes + bytes_})
            for (const std::uint32_t word : buffer_.download<std::uint32_t>(kGuardBytes / 4, at))
                if (word != kPoison)
                    return testing::AssertionFailure()
                           << fmt::format("{}: {:#x} stands among the guard words {} its content",
                                          buffer_.name(), word, at == 0 ? "before" : "after");
        return testing::AssertionSuccess();
    }

  private:
    static constexpr std::uint64_t kGuardBytes = 256;  // the largest offset alignment that exists
    Buffer buffer_;
    std::uint64_t bytes_;
};

}  // namespace darb::test
