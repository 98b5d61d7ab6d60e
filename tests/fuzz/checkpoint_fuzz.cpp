// SPDX-License-Identifier: MIT
// Any bytes as a checkpoint: a state or an Error, never a crash. The checksum is made right first,
// so that what stands behind it is reached.
#include <zlib.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "engine/core/error.h"
#include "trainer/step/checkpoint.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    std::vector<std::uint8_t> bytes(data, data + size);
    constexpr std::size_t kCrcAt = 12, kCovered = 16;  // as checkpoint.cpp lays them out
    if (size > kCovered) {
        const auto crc = static_cast<std::uint32_t>(
            crc32(0, bytes.data() + kCovered, static_cast<uInt>(size - kCovered)));
        std::memcpy(bytes.data() + kCrcAt, &crc, 4);
    }
    try {
        const darb::Checkpoint c = darb::parse_checkpoint(std::as_bytes(std::span(bytes)), "fuzz");
        DARB_CHECK(c.state.gradient_sum.size() == c.state.model.size() * 2);
    } catch (const darb::Error&) {
    }
    return 0;
}
