// SPDX-License-Identifier: MIT
// Any bytes as USD text: a model or an Error, never a crash.
#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/core/error.h"
#include "engine/scene/splat_file.h"
#include "engine/scene/splat_model.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    try {
        darb::check_splat_shapes(
            darb::parse_splats(std::as_bytes(std::span(data, size)), "fuzz.usda"));
    } catch (const darb::Error&) {
    }
    return 0;
}
