// SPDX-License-Identifier: MIT
// Any bytes as .splat: a model or an Error, never a crash; what was read survives writing.
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/error.h"
#include "engine/scene/dot_splat.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto file = std::as_bytes(std::span(data, size));
    try {
        darb::looks_like_dot_splat(file);
        const darb::SplatModel model = darb::parse_dot_splat(file, "fuzz");
        const std::vector<std::byte> again = darb::encode_dot_splat(model);
        DARB_CHECK(again.size() == 32 * model.size(), "{}", again.size());
    } catch (const darb::Error&) {
    }
    return 0;
}
