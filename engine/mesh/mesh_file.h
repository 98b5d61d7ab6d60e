// SPDX-License-Identifier: MIT
// Files of triangle meshes: .ply, .obj, .glb and .gltf, written and read; and point clouds, which
// are meshes without faces. Axes are those of splat files: PLY and OBJ have the numbers as they
// are, glTF is turned to y up and back.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "engine/mesh/triangle_mesh.h"
#include "engine/scene/splat_file.h"

namespace darb {

struct MeshFileOptions {
    int jpeg_quality = 0;  // 1 to 100 for pages as JPEG; 0: PNG
};

/// The endings that can be written and read: ".ply, .obj, .glb, .gltf".
std::string mesh_endings();

/// The file and those beside it, by the ending of `where`:
///   .ply   binary, a double for a coordinate where origin is not 0; holds no texture
///   .obj   with as many digits as tell every vertex apart; .mtl and pages beside it
///   .glb   the origin is the translation of the node; pages are within
///   .gltf  the same as text, .bin and pages beside it
/// texture: null, or of the mesh's faces. Throws Error where the ending is unknown, where the mesh
/// has no vertices, and where the format has no place for something.
EncodedSplats encode_mesh(const TriangleMesh& mesh, const std::string& where,
                          const MeshTexture* texture = nullptr,
                          const MeshFileOptions& options = {});

/// Writes each file to a temporary name and renames it, the one at `path` last. Throws Error.
void write_mesh(const std::filesystem::path& path, const TriangleMesh& mesh,
                const MeshTexture* texture = nullptr, const MeshFileOptions& options = {});

struct MeshReadOptions {
    /// Vertices without colours take those of the texture in a .glb or .gltf, at their places on
    /// it.
    bool colours_of_textures = false;
};

/// Reads a mesh, or points where the file has no faces. PLY and glTF are known by their content,
/// OBJ by its ending. Polygons become fans of triangles. Colours of vertices and normals are kept,
/// textures are not, but for what options ask for. Positions are relative to an origin where
/// float32 would cut them. notes: where not null, receives a sentence on what was left out. Throws
/// Error naming file, place, reason and remedy.
TriangleMesh read_mesh(const std::filesystem::path& path, std::vector<std::string>* notes = nullptr,
                       const MeshReadOptions& options = {});

/// As read_mesh. where: the file's name; folder: where files beside it are, empty: none can be
/// read.
TriangleMesh parse_mesh(std::span<const std::byte> file, const std::string& where,
                        const std::filesystem::path& folder = {},
                        std::vector<std::string>* notes = nullptr,
                        const MeshReadOptions& options = {});

}  // namespace darb
