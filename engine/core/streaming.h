// SPDX-License-Identifier: MIT
// Non-temporal writes, for memory that this processor will not read again soon, such as mapped
// device buffers. A cache line is not read before it is written, and the caches keep what they
// hold. On processors without such writes, these are ordinary ones.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace darb {

constexpr std::size_t kStreamFloats = 4, kStreamBytes = kStreamFloats * sizeof(float);

/// Whether FloatStream may write here: the address must be a multiple of 16 bytes, except for
/// plain().
inline bool can_stream(const std::byte* to) {
    return reinterpret_cast<std::uintptr_t>(to) % kStreamBytes == 0;
}

/// Writes floats, and keeps track of whether all of them were finite. The values pass through a
/// register anyway, so this costs no second pass.
class FloatStream {
  public:
    /// Writes four floats. stream_fence() makes them visible to others.
    void four(std::byte* to, const float* from) {
#if defined(__SSE2__)
        put(to, _mm_loadu_ps(from));
#else
        put(to, {from[0], from[1], from[2], from[3]});
#endif
    }

    /// Writes one float and three zeros.
    void one(std::byte* to, const float* from) {
#if defined(__SSE2__)
        put(to, _mm_load_ss(from));
#else
        put(to, {from[0], 0, 0, 0});
#endif
    }

    void floats(std::byte* to, const float* from, std::size_t count) {
        std::size_t i = 0;
        for (; i + kStreamFloats <= count; i += kStreamFloats)
            four(to + i * sizeof(float), from + i);
        if (i < count) plain(to + i * sizeof(float), from + i, count - i);
    }

    /// Writes through the caches, to any address.
    void plain(std::byte* to, const float* from, std::size_t count) {
        std::memcpy(to, from, count * sizeof(float));
        for (std::size_t i = 0; i < count; ++i) sum_ += 0 * from[i];
    }

    bool finite() const {
        std::array<std::uint32_t, kStreamFloats> marks{};
        std::memcpy(marks.data(), &marks_, kStreamBytes);
        return ((marks[0] | marks[1] | marks[2] | marks[3]) << 1) == 0 && sum_ == 0;
    }

  private:
#if defined(__SSE2__)
    using Four = __m128;
    void put(std::byte* to, Four values) {
        _mm_stream_ps(reinterpret_cast<float*>(to), values);
        marks_ = _mm_or_ps(marks_, _mm_mul_ps(values, _mm_setzero_ps()));
    }
#else
    using Four = std::array<float, kStreamFloats>;
    void put(std::byte* to, const Four& values) {
        std::memcpy(to, values.data(), kStreamBytes);
        for (const float value : values) sum_ += 0 * value;
    }
#endif

    // Products of 0 and the values written, which are NaN where a value is not finite: combined bit
    // by bit with OR for the streamed ones, as that dependency chain is short, and summed for the
    // others.
    Four marks_{};
    float sum_ = 0;
};

inline void stream_fence() {
#if defined(__SSE2__)
    _mm_sfence();
#endif
}

}  // namespace darb
