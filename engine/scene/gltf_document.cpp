#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/json_text.h"
#include "engine/core/text.h"
#include "engine/scene/gltf.h"
#include "engine/scene/quantise.h"

namespace darb::gltf {

namespace {

using nlohmann::json;
using GltfBytes = std::span<const std::byte>;
namespace fs = std::filesystem;

constexpr int kMostDepth = 64;  // of the JSON; glTF itself needs 10 or so

json parse_text(GltfBytes text, const std::string& where) {
    const auto* begin = reinterpret_cast<const char*>(text.data());
    const json::parser_callback_t limit = [&](int depth, json::parse_event_t, json&) {
        if (depth > kMostDepth)
            throw Error(where, fmt::format("its JSON is nested more than {} deep", kMostDepth),
                        kCopyAgain);
        return true;
    };
    try {
        return json::parse(begin, begin + text.size(), limit);
    } catch (const json::parse_error& error) {
        throw Error(where, json_fault({begin, text.size()}, error), kCopyAgain);
    }
}

struct GlbParts {
    GltfBytes text, binary;
};

GlbParts split_glb(GltfBytes file, const std::string& where) {
    const auto cut = [&](std::size_t needed) {
        return Error(where, fmt::format("holds {} bytes of {}: it is cut off", file.size(), needed),
                     kCopyAgain);
    };
    if (file.size() < kGlbHeader) throw cut(kGlbHeader);
    if (const auto version = load_le<std::uint32_t>(file, 4); version != 2)
        throw Error(where, fmt::format("is GLB version {}; 2 is known", version),
                    "Export it as glTF 2.0.");
    const std::size_t length = load_le<std::uint32_t>(file, 8);
    if (length > file.size()) throw cut(length);
    GlbParts parts;
    for (std::size_t at = kGlbHeader; at + kGlbChunkHeader <= length;) {
        const std::size_t size = load_le<std::uint32_t>(file, at);
        const auto type = load_le<std::uint32_t>(file, at + 4);
        at += kGlbChunkHeader;
        if (size > length - at) throw cut(at + size);
        const GltfBytes chunk = file.subspan(at, size);
        if (type == kGlbJson && !parts.text.data()) parts.text = chunk;
        if (type == kGlbBin && !parts.binary.data()) parts.binary = chunk;
        at += size;
    }
    if (parts.text.empty()) throw Error(where, "has no chunk of JSON", kCopyAgain);
    return parts;
}

int digit_of_base64(char c) {
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    return c == '+' ? 62 : c == '/' ? 63 : -1;
}

std::vector<std::byte> from_data_uri(std::string_view uri, const std::string& where) {
    const std::size_t comma = uri.find(',');
    if (comma == std::string_view::npos || !uri.substr(0, comma).ends_with(";base64"))
        throw Error(where, "its data URI is not base64", kCopyAgain);
    std::string_view text = uri.substr(comma + 1);
    while (!text.empty() && text.back() == '=') text.remove_suffix(1);
    std::vector<std::byte> bytes;
    bytes.reserve(text.size() * 3 / 4);
    unsigned bits = 0, held = 0;
    for (const char c : text) {
        const int digit = digit_of_base64(c);
        if (digit < 0) throw Error(where, "its data URI has a character beyond base64", kCopyAgain);
        bits = bits << 6 | static_cast<unsigned>(digit);
        held += 6;
        if (held < 8) continue;
        held -= 8;
        bytes.push_back(static_cast<std::byte>(bits >> held & 255));
    }
    return bytes;
}

std::string percent_decoded(std::string_view uri, const std::string& where) {
    const auto digit = [&](char c) {
        const char l = c >= 'A' && c <= 'F' ? static_cast<char>(c - 'A' + 'a') : c;
        if (l >= '0' && l <= '9') return l - '0';
        if (l >= 'a' && l <= 'f') return l - 'a' + 10;
        throw Error(where, "its URI has a % without two digits", kCopyAgain);
    };
    std::string text;
    for (std::size_t i = 0; i < uri.size(); ++i) {
        if (uri[i] != '%') {
            text += uri[i];
            continue;
        }
        if (i + 2 >= uri.size())
            throw Error(where, "its URI has a % without two digits", kCopyAgain);
        text += static_cast<char>(16 * digit(uri[i + 1]) + digit(uri[i + 2]));
        i += 2;
    }
    return text;
}

/// In the folder of the .gltf or below it.
std::vector<std::byte> from_file(std::string_view uri, const SplatSource& source,
                                 const std::string& where) {
    const std::string name = percent_decoded(uri, where);
    const fs::path path = name;
    const bool outside = name.empty() || path.is_absolute() ||
                         name.find_first_of(std::string_view(":\\\0", 3)) != std::string::npos ||
                         std::ranges::any_of(path, [](const fs::path& one) { return one == ".."; });
    if (outside)
        throw Error(where, "is '" + printable(name) + "', which is no file beside this one",
                    "Put the files of the scene into one folder, and name them without it.");
    if (source.folder.empty())
        throw Error(where, "is the file '" + printable(name) + "', and this scene has no folder",
                    "Write the scene as .glb, which holds its buffers.");
    return read_file(source.folder / path);
}

std::vector<std::byte> load_buffer(const json& buffer, GltfBytes binary, const SplatSource& source,
                                   const std::string& where) {
    if (!buffer.contains("uri")) return {binary.begin(), binary.end()};
    const auto& uri = buffer.at("uri").get_ref<const std::string&>();
    return lower(uri.substr(0, 5)) == "data:" ? from_data_uri(uri, where)
                                              : from_file(uri, source, where);
}

ComponentType component_type(std::size_t number, const std::string& what) {
    for (const ComponentType known : {kInt8, kUint8, kInt16, kUint16, kUint32, kFloat})
        if (number == known) return known;
    throw Error(what, fmt::format("has the unknown component type {}", number), kCopyAgain);
}

std::size_t bytes_of(ComponentType type) {
    return type == kInt8 || type == kUint8 ? 1 : type == kInt16 || type == kUint16 ? 2 : 4;
}

int components_of(const std::string& type, const std::string& what) {
    constexpr std::pair<const char*, int> kTypes[] = {
        {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}};
    for (const auto& [name, count] : kTypes)
        if (type == name) return count;
    throw Error(what, "has the type '" + printable(type) + "', which no attribute of splats has",
                kCopyAgain);
}

}  // namespace

std::string harmonic_name(int coefficient) {
    int degree = 0;
    while ((degree + 1) * (degree + 1) <= coefficient) ++degree;
    return fmt::format("{}:SH_DEGREE_{}_COEF_{}", kSplats, degree, coefficient - degree * degree);
}

std::size_t whole_number(const json& object, const char* key) {
    const json& value = object.at(key);
    if (!value.is_number_unsigned())
        throw json::type_error::create(302, fmt::format("{} is no whole number", key), &object);
    return value.get<std::size_t>();
}

std::size_t whole_number(const json& object, const char* key, std::size_t otherwise) {
    return object.contains(key) ? whole_number(object, key) : otherwise;
}

Document open_document(const SplatSource& source) {
    GlbParts parts{source.bytes, {}};
    if (starts_with(source.bytes, "glTF")) parts = split_glb(source.bytes, source.where);
    Document document;
    document.where = source.where;
    document.bytes = source.bytes.size();
    document.json = parse_text(parts.text, source.where);
    const json buffers = document.json.value("buffers", json::array());
    for (std::size_t i = 0; i < buffers.size(); ++i) {
        const std::string where = fmt::format("{}, buffer {}", source.where, i);
        // The chunk of a .glb is its first buffer.
        document.buffers.push_back(
            load_buffer(buffers[i], i == 0 ? parts.binary : GltfBytes{}, source, where));
        const std::size_t declared = whole_number(buffers[i], "byteLength");
        if (declared > document.buffers.back().size())
            throw Error(where,
                        fmt::format("has {} bytes of {}", document.buffers.back().size(), declared),
                        kCopyAgain);
        document.buffers.back().resize(declared);
        if (buffers[i].contains("uri")) document.bytes += declared;
    }
    return document;
}

double Accessor::value(std::size_t element, int component) const {
    const std::size_t at = element * stride;
    const auto c = static_cast<std::size_t>(component);
    switch (type) {
        case kInt8: {
            const double v = load_le<std::int8_t>(bytes, at + c);
            return normalized ? std::max(v / 127, -1.0) : v;
        }
        case kUint8: {
            const double v = load_le<std::uint8_t>(bytes, at + c);
            return normalized ? v / 255 : v;
        }
        case kInt16: {
            const double v = load_le<std::int16_t>(bytes, at + 2 * c);
            return normalized ? std::max(v / 32767, -1.0) : v;
        }
        case kUint16: {
            const double v = load_le<std::uint16_t>(bytes, at + 2 * c);
            return normalized ? v / 65535 : v;
        }
        case kUint32:
            return load_le<std::uint32_t>(bytes, at + 4 * c);
        case kFloat:
            return double{load_le<float>(bytes, at + 4 * c)};
    }
    return 0;
}

Accessor find_accessor(const Document& document, std::size_t index, const std::string& what) {
    const std::string place = document.where + ", " + what;
    const json& accessor = document.json.at("accessors").at(index);
    if (accessor.contains("sparse") || !accessor.contains("bufferView"))
        throw Error(place, "is a sparse accessor, which is not read",
                    "Export the scene with plain accessors.");
    const json& view = document.json.at("bufferViews").at(whole_number(accessor, "bufferView"));
    const std::vector<std::byte>& buffer = document.buffers.at(whole_number(view, "buffer"));
    Accessor result;
    result.count = whole_number(accessor, "count");
    result.type = component_type(whole_number(accessor, "componentType"), place);
    result.normalized = accessor.value("normalized", false);
    result.components = components_of(accessor.at("type").get<std::string>(), place);
    const std::size_t element = bytes_of(result.type) * static_cast<std::size_t>(result.components);
    result.stride = whole_number(view, "byteStride", element);
    const std::size_t view_at = whole_number(view, "byteOffset", 0),
                      view_bytes = whole_number(view, "byteLength"),
                      first = whole_number(accessor, "byteOffset", 0);
    const bool fits =
        view_at <= buffer.size() && view_bytes <= buffer.size() - view_at && first <= view_bytes &&
        result.stride >= element && result.stride <= 252 &&
        (result.count == 0 || (view_bytes - first >= element &&
                               (view_bytes - first - element) / result.stride >= result.count - 1));
    if (!fits)
        throw Error(place, fmt::format("{} elements do not lie within its buffer", result.count),
                    kCopyAgain);
    result.bytes = std::span(buffer).subspan(view_at + first, view_bytes - first);
    return result;
}

}  // namespace darb::gltf
