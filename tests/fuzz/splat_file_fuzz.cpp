// SPDX-License-Identifier: MIT
// Any bytes as any splat file: a model or an Error, never a crash; its arrays fit together.
#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/core/error.h"
#include "engine/scene/splat_file.h"
#include "engine/scene/splat_model.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto file = std::as_bytes(std::span(data, size));
    try {
        darb::check_splat_shapes(darb::parse_splats(file, "fuzz"));
    } catch (const darb::Error&) {
    }
    return 0;
}
