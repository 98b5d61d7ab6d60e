// SPDX-License-Identifier: MIT
// glTF 2.0 with splats (KHR_gaussian_splatting), as .glb or .gltf: what the reader and the writer
// share. docs/gltf.md says what is read and written, and describes darb's own extension.
#pragma once

#include <cstddef>
#include <cstdint>
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

/// Sentences on what other programs draw in place of a kernel that is not Gaussian.
std::vector<std::string> fallback_losses(const SplatModel& model, const std::string& where);
/// Encodes a .glb or, where `where` ends in .gltf, JSON with a .bin beside it.
EncodedSplats encode(const SplatModel& model, const std::string& where, const EncodeOptions&);

}  // namespace darb::gltf
