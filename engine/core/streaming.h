// Writes that go past the caches: for what this processor does not read again soon, as buffers of
// the device. A line is not read before it is written, and what lies in the caches stays there.
// Where the processor has no such writes they are plain ones.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace darb {

constexpr std::size_t kStreamFloats = 4, kStreamBytes = kStreamFloats * sizeof(float);

/// What the functions below may write to: a multiple of 16 bytes.
inline bool can_stream(const std::byte* to) {
    return reinterpret_cast<std::uintptr_t>(to) % kStreamBytes == 0;
}

/// Four floats. stream_fence() makes them visible to others.
inline void stream_four(std::byte* to, const float* from) {
#if defined(__SSE2__)
    _mm_stream_ps(reinterpret_cast<float*>(to), _mm_loadu_ps(from));
#else
    std::memcpy(to, from, kStreamBytes);
#endif
}

/// One float and three zeros.
inline void stream_one(std::byte* to, const float* from) {
#if defined(__SSE2__)
    _mm_stream_ps(reinterpret_cast<float*>(to), _mm_load_ss(from));
#else
    const float four[kStreamFloats] = {*from};
    std::memcpy(to, four, kStreamBytes);
#endif
}

inline void stream_floats(std::byte* to, const float* from, std::size_t count) {
    std::size_t i = 0;
    for (; i + kStreamFloats <= count; i += kStreamFloats)
        stream_four(to + i * sizeof(float), from + i);
    if (i < count) std::memcpy(to + i * sizeof(float), from + i, (count - i) * sizeof(float));
}

inline void stream_fence() {
#if defined(__SSE2__)
    _mm_sfence();
#endif
}

}  // namespace darb
