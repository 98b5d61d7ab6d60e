// SPDX-License-Identifier: MIT
// Any bytes as PLY, glTF or OBJ: a mesh whose faces name vertices that it has, or an Error, never a
// crash; what was read is written and read again.
#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/core/error.h"
#include "engine/mesh/mesh_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto file = std::as_bytes(std::span(data, size));
    const char* where = size > 0 && data[0] == '{' ? "fuzz.gltf" : "fuzz.obj";
    try {
        const darb::TriangleMesh mesh = darb::parse_mesh(file, where);
        for (const auto& face : mesh.face)
            for (const std::uint32_t vertex : face)
                DARB_CHECK(vertex < mesh.vertex_count(), "{} of {}", vertex, mesh.vertex_count());
        const darb::EncodedSplats again = darb::encode_mesh(mesh, "again.ply");
        const darb::TriangleMesh read = darb::parse_mesh(again.file, "again.ply");
        DARB_CHECK(read.face_count() == mesh.face_count(), "{} and {}", read.face_count(),
                   mesh.face_count());
    } catch (const darb::Error&) {
    }
    return 0;
}
