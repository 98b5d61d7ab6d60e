// SPDX-License-Identifier: MIT
// Any bytes as glTF: a model or an Error, never a crash; what was read is written and read again.
#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/core/error.h"
#include "engine/scene/splat_file.h"
#include "engine/scene/splat_model.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto file = std::as_bytes(std::span(data, size));
    try {
        const darb::SplatModel model = darb::parse_splats(file, "fuzz.gltf");
        darb::check_splat_shapes(model);
        const darb::EncodedSplats again = darb::encode_scene(darb::SplatFormat::gltf, model);
        const std::size_t read = darb::parse_splats(again.file, "again").size();
        DARB_CHECK(read <= model.size(), "{} and {}", read, model.size());
    } catch (const darb::Error&) {
    }
    return 0;
}
