// SPDX-License-Identifier: MIT
// Any bytes as PLY: a model or an Error, never a crash; what was read survives writing.
#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/core/error.h"
#include "engine/data/point_cloud_ply.h"
#include "engine/scene/ply.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto file = std::as_bytes(std::span(data, size));
    try {
        const darb::SplatModel model = darb::parse_ply(file, "fuzz");
        const darb::SplatModel again = darb::parse_ply(darb::encode_ply(model), "again");
        DARB_CHECK(again.size() == model.size(), "{} and {}", again.size(), model.size());
    } catch (const darb::Error&) {
    }
    try {
        std::size_t dropped = 0;
        const darb::PointCloud cloud = darb::parse_point_cloud_ply(file, "fuzz", dropped);
        DARB_CHECK(cloud.position.size() == cloud.colour.size());
    } catch (const darb::Error&) {
    }
    return 0;
}
