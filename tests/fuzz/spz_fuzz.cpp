// SPDX-License-Identifier: MIT
// Any bytes as SPZ: a model or an Error, never a crash; what was read survives writing.
#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/core/error.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/spz.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto file = std::as_bytes(std::span(data, size));
    try {
        darb::SplatModel model = darb::parse_spz(file, "fuzz");
        darb::drop_non_finite(model);
        const darb::SplatModel again = darb::parse_spz(darb::encode_spz(model), "again");
        DARB_CHECK(again.size() == model.size(), "{} and {}", again.size(), model.size());
    } catch (const darb::Error&) {
    }
    return 0;
}
