// Writes that go past the caches: for what this processor does not read again soon, as buffers of
// the device. A line is not read before it is written, and what lies in the caches stays there.
// Where the processor has no such writes they are plain ones.
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

/// What FloatStream may write to, but for plain(): a multiple of 16 bytes.
inline bool can_stream(const std::byte* to) {
    return reinterpret_cast<std::uintptr_t>(to) % kStreamBytes == 0;
}

/// Writes floats, and knows whether all that it wrote were finite: as they pass a register anyway,
/// it costs no second look at them.
class FloatStream {
  public:
    /// Four floats. stream_fence() makes them visible to others.
    void four(std::byte* to, const float* from) {
#if defined(__SSE2__)
        put(to, _mm_loadu_ps(from));
#else
        put(to, {from[0], from[1], from[2], from[3]});
#endif
    }

    /// One float and three zeros.
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

    /// Through the caches, to anywhere.
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

    // Of 0 times what was written, which is NaN where that is not finite: the bits together, whose
    // chain is short, and the sum of the others.
    Four marks_{};
    float sum_ = 0;
};

inline void stream_fence() {
#if defined(__SSE2__)
    _mm_sfence();
#endif
}

}  // namespace darb
