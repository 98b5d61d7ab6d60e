// SPDX-License-Identifier: MIT
// Any bytes as compressed PLY: a model or an Error, never a crash; what was read survives writing.
#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/core/error.h"
#include "engine/scene/compressed_ply.h"
#include "engine/scene/ply.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto file = std::as_bytes(std::span(data, size));
    try {
        const darb::PlyHeader header = darb::parse_ply_header(file, "fuzz");
        if (!darb::is_compressed_ply(header)) return 0;
        const darb::SplatModel model = darb::parse_compressed_ply(file, header, "fuzz", nullptr);
        const darb::SplatModel again = darb::parse_ply(darb::encode_compressed_ply(model), "again");
        DARB_CHECK(again.size() == model.size(), "{} and {}", again.size(), model.size());
    } catch (const darb::Error&) {
    }
    return 0;
}
