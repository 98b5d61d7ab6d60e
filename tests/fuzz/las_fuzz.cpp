// SPDX-License-Identifier: MIT
// Any bytes as LAS points: a cloud or an Error, never a crash.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "engine/core/error.h"
#include "engine/data/las_points.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    std::size_t dropped = 0;
    try {
        const darb::PointCloud points =
            darb::parse_las(std::as_bytes(std::span(data, size)), "fuzz.las", dropped);
        if (points.colour.size() != points.position.size()) std::abort();
    } catch (const darb::Error&) {
    }
    return 0;
}
