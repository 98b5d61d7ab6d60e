// SPDX-License-Identifier: MIT
// glTF 2.0 as .glb or .gltf: what readers and writers of splats (KHR_gaussian_splatting) and of
// triangle meshes share. docs/gltf.md says what is read and written of splats, and describes darb's
// own extension.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "engine/scene/splat_format.h"

namespace darb::gltf {

constexpr const char* kSplats = "KHR_gaussian_splatting";
constexpr const char* kRadial = "EXT_gaussian_splatting_kernel_radial";  // docs/gltf.md
constexpr const char* kRotation = "KHR_gaussian_splatting:ROTATION";
constexpr const char* kScale = "KHR_gaussian_splatting:SCALE";
constexpr const char* kOpacity = "KHR_gaussian_splatting:OPACITY";
/// "KHR_gaussian_splatting:SH_DEGREE_1_COEF_2"; coefficient 0 is the constant one.
std::string harmonic_name(int coefficient);

constexpr std::uint32_t kGlbMagic = 0x46546c67, kGlbJson = 0x4e4f534a, kGlbBin = 0x004e4942;
constexpr std::size_t kGlbHeader = 12, kGlbChunkHeader = 8;  // bytes

enum ComponentType { kInt8 = 5120, kUint8, kInt16, kUint16, kUint32 = 5125, kFloat };

/// The JSON and the buffers that it names, wherever these are stored.
struct Document {
    nlohmann::json json;
    std::vector<std::vector<std::byte>> buffers;
    std::size_t bytes = 0;  // total size of what was read
    std::string where;
};

/// Reads JSON, or the chunks of a .glb. Buffers come from the .glb, data URIs, or files in the
/// source's folder and its subfolders, and from nowhere else. Throws Error.
Document open_document(const SplatSource& source);

/// Numbers of an accessor, which lie within its buffer.
struct Accessor {
    std::span<const std::byte> bytes;  // from the first element on
    std::size_t count = 0, stride = 0;
    int components = 0;
    ComponentType type = kFloat;
    bool normalized = false;

    /// Normalised integers are mapped to 0..1 or -1..1.
    double value(std::size_t element, int component) const;
};

/// json[key] as a whole number >= 0; `otherwise` where the key is missing.
std::size_t whole_number(const nlohmann::json& object, const char* key, std::size_t otherwise);
/// As above, but throws Error where the key is missing.
std::size_t whole_number(const nlohmann::json& object, const char* key);

/// what: names the accessor in errors. Throws Error where it is sparse or lies outside its buffer.
Accessor find_accessor(const Document& document, std::size_t index, const std::string& what);

/// Throws Error where the file needs an extension whose name is not among these.
void check_extensions(const Document& document, std::span<const char* const> known);

/// glTF has y up and z backward; scenes in memory have y down and z forward, as SPZ's are turned.
inline const glm::dmat4 kFromYUp{1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1};

/// Calls visit(mesh, to_world) for the mesh of each node that is drawn, to_world from the mesh's
/// frame to that of scenes in memory. Throws Error where the nodes are no tree.
void visit_meshes(
    const Document& document,
    const std::function<void(const nlohmann::json& mesh, const glm::dmat4& to_world)>& visit);

/// The buffer and the JSON that describes it, as they grow.
struct Writer {
    std::vector<std::byte> buffer;
    nlohmann::json views = nlohmann::json::array(), accessors = nlohmann::json::array();

    /// Adds an attribute of vertices, [N][components] of float or of normalised std::uint8_t or
    /// std::uint16_t, whose elements are multiples of 4 bytes. facts: further members of the
    /// accessor. Returns its index.
    template <class T>
    std::size_t add(const std::vector<T>& values, int components,
                    nlohmann::json facts = nlohmann::json::object());
    /// Adds the vertices of triangles; returns the accessor's index.
    std::size_t add_indices(std::span<const std::uint32_t> values);
    /// Adds bytes and their view, from a multiple of 4 bytes on; facts: further members of the
    /// view. Returns its index.
    std::size_t add_view(std::span<const std::byte> bytes,
                         nlohmann::json facts = nlohmann::json::object());
};

/// {"min": [3], "max": [3]} of positions [N][3], as their accessor needs them.
nlohmann::json bounds_of(const std::vector<float>& position);
/// {"rotation": .., "translation": ..} of a node whose mesh has the axes of scenes in memory and
/// whose positions are relative to `origin`; without the translation where that is 0.
nlohmann::json node_at(const glm::dvec3& origin);
/// A file name as the URI of a buffer or an image.
std::string percent_encoded(const std::string& name);
/// The files of a document, to which this adds asset, scene, accessors, views and the buffer: a
/// .glb or, where `where` ends in .gltf, JSON with a .bin beside it. Throws Error where a .glb
/// would exceed 4 GiB.
EncodedSplats pack_document(nlohmann::json document, Writer&& writer, const std::string& where);

/// Sentences on what other programs draw in place of a kernel that is not Gaussian.
std::vector<std::string> fallback_losses(const SplatModel& model, const std::string& where);
/// Encodes a .glb or, where `where` ends in .gltf, JSON with a .bin beside it.
EncodedSplats encode(const SplatModel& model, const std::string& where, const EncodeOptions&);

}  // namespace darb::gltf
