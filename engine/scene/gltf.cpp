// SPDX-License-Identifier: MIT
#include "engine/scene/gltf.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <optional>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/json_text.h"
#include "engine/core/text.h"
#include "engine/kernels/kernel_definition.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/scene/dot_splat.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/inflate.h"
#include "engine/scene/quantise.h"
#include "engine/scene/splat_model.h"

namespace darb::gltf {

namespace {

using nlohmann::json;
using GltfBytes = std::span<const std::byte>;
namespace fs = std::filesystem;

constexpr int kMostDepth = 64;  // nesting of the JSON; glTF itself needs about 10

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

/// Reads a file in the folder of the .gltf or below.
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
    throw Error(what, "has the type '" + printable(type) + "', which no attribute has", kCopyAgain);
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

namespace {

glm::dmat4 matrix_of(const json& node) {
    glm::dmat4 matrix(1.0);
    if (node.contains("matrix")) {
        for (int c = 0; c < 16; ++c)
            matrix[c / 4][c % 4] = node.at("matrix").at(static_cast<std::size_t>(c)).get<double>();
        return matrix;
    }
    const auto number = [&](const char* key, std::size_t i, double otherwise) {
        return node.contains(key) ? node.at(key).at(i).get<double>() : otherwise;
    };
    const glm::dquat turn(number("rotation", 3, 1), number("rotation", 0, 0),
                          number("rotation", 1, 0), number("rotation", 2, 0));
    const glm::dmat3 axes = glm::mat3_cast(turn);
    for (int c = 0; c < 3; ++c) {
        matrix[c] = glm::dvec4(axes[c] * number("scale", static_cast<std::size_t>(c), 1), 0.0);
        matrix[3][c] = number("translation", static_cast<std::size_t>(c), 0);
    }
    return matrix;
}

/// The nodes that are drawn: those of the scene, or all that are no node's children.
std::vector<std::size_t> root_nodes(const json& document, std::size_t count) {
    std::vector<std::size_t> roots;
    if (document.contains("scenes") && !document.at("scenes").empty()) {
        const json& scene = document.at("scenes").at(whole_number(document, "scene", 0));
        for (const json& node : scene.value("nodes", json::array()))
            roots.push_back(node.get<std::size_t>());
        return roots;
    }
    std::vector<bool> child(count, false);
    for (const json& node : document.value("nodes", json::array()))
        for (const json& one : node.value("children", json::array()))
            if (const auto at = one.get<std::size_t>(); at < count) child[at] = true;
    for (std::size_t i = 0; i < count; ++i)
        if (!child[i]) roots.push_back(i);
    return roots;
}

}  // namespace

void check_extensions(const Document& document, std::span<const char* const> known) {
    for (const json& one : document.json.value("extensionsRequired", json::array()))
        if (const auto name = one.get<std::string>();
            std::ranges::find(known, name) == std::end(known))
            throw Error(document.where, "needs " + printable(name) + ", which is not read",
                        "Export the scene without compression.");
}

void visit_meshes(const Document& document,
                  const std::function<void(const json& mesh, const glm::dmat4& to_world)>& visit) {
    const json none = json::array();
    const json& nodes = document.json.contains("nodes") ? document.json.at("nodes") : none;
    struct Visit {
        std::size_t node;
        glm::dmat4 parent;
    };
    std::vector<Visit> stack;
    for (const std::size_t root : root_nodes(document.json, nodes.size()))
        stack.push_back({root, kFromYUp});
    std::reverse(stack.begin(), stack.end());
    std::vector<bool> seen(nodes.size(), false);
    while (!stack.empty()) {
        const Visit next = stack.back();
        stack.pop_back();
        const json& node = nodes.at(next.node);
        if (seen[next.node])
            throw Error(document.where,
                        fmt::format("node {} is met twice: nodes are no tree", next.node),
                        kCopyAgain);
        seen[next.node] = true;
        const glm::dmat4 to_world = next.parent * matrix_of(node);
        if (node.contains("mesh"))
            visit(document.json.at("meshes").at(whole_number(node, "mesh")), to_world);
        for (const json& child : node.value("children", json::array()))
            stack.push_back({child.get<std::size_t>(), to_world});
    }
}

}  // namespace darb::gltf

namespace darb {

namespace {

using gltf::Accessor;
using gltf::Document;
using nlohmann::json;

constexpr double kSameLength = 1e-4;  // relative tolerance for the lengths of a node's axes

unsigned bit(gltf::ComponentType type, bool normalized) {
    return 1u << (2 * static_cast<unsigned>(type - gltf::kInt8) + (normalized ? 1u : 0u));
}
// What KHR_gaussian_splatting allows and, for positions, KHR_mesh_quantization.
const unsigned kFloats = bit(gltf::kFloat, false);
const unsigned kSignedUnits = bit(gltf::kInt8, true) | bit(gltf::kInt16, true);
const unsigned kUnsignedUnits = bit(gltf::kUint8, true) | bit(gltf::kUint16, true);
const unsigned kSigned = bit(gltf::kInt8, false) | bit(gltf::kInt16, false);
const unsigned kPositions = kFloats | kSignedUnits | kUnsignedUnits | kSigned |
                            bit(gltf::kUint8, false) | bit(gltf::kUint16, false);

/// A primitive with splats, and where its node puts it.
struct PlacedSplats {
    const json& primitive;
    glm::dmat4 to_world;
};

/// What darb's own extension says about a primitive.
struct RadialKernel {
    int kernel = KERNEL_GAUSSIAN;
    Footprint footprint = Footprint::psi;
    bool antialias = false;
};

struct GltfScene {
    const Document& document;
    SplatFile& file;

    Error wrong(const std::string& what, const std::string& hint = kCopyAgain) const {
        return {document.where, what, hint};
    }
    void note(const std::string& text) {
        if (std::ranges::find(file.notes, text) == file.notes.end()) file.notes.push_back(text);
    }
};

/// The accessor of a primitive's attribute, or of one of darb's extension. allowed: bits.
std::optional<Accessor> attribute(const GltfScene& scene, const json& attributes, const char* name,
                                  int components, unsigned allowed) {
    if (!attributes.contains(name)) return std::nullopt;
    const Accessor found =
        gltf::find_accessor(scene.document, gltf::whole_number(attributes, name), name);
    if (found.components != components || !(allowed & bit(found.type, found.normalized)))
        throw scene.wrong(fmt::format("{} has {} components of type {}{}, which it may not", name,
                                      found.components, static_cast<int>(found.type),
                                      found.normalized ? ", normalised" : ""));
    return found;
}

Accessor needed(const GltfScene& scene, const json& attributes, const char* name, int components,
                unsigned allowed) {
    const std::optional<Accessor> found = attribute(scene, attributes, name, components, allowed);
    if (!found) throw scene.wrong(fmt::format("a primitive with splats lacks {}", name));
    return *found;
}

/// Reads [N][components], with as many elements as there are positions.
template <class F>
void fill(const GltfScene& scene, const Accessor& from, const char* name, std::size_t stride,
          std::vector<float>& to, const F& change) {
    const std::size_t count = to.size() / stride;
    if (from.count != count)
        throw scene.wrong(
            fmt::format("{} has {} values for {} positions", name, from.count, count));
    for (std::size_t i = 0; i < count; ++i)
        for (int c = 0; c < from.components; ++c)
            to[i * stride + static_cast<std::size_t>(c)] =
                static_cast<float>(change(from.value(i, c)));
}

constexpr auto kAsItIs = [](double value) { return value; };

/// Collects the splats of a mesh; other primitives are counted.
void add_splats_of(const json& mesh, const glm::dmat4& to_world, std::vector<PlacedSplats>& placed,
                   std::size_t& others) {
    for (const json& primitive : mesh.at("primitives")) {
        const bool splats =
            primitive.contains("extensions") && primitive.at("extensions").contains(gltf::kSplats);
        if (splats)
            placed.push_back({primitive, to_world});
        else
            ++others;
    }
}

std::vector<PlacedSplats> placed_splats(GltfScene& scene) {
    std::vector<PlacedSplats> placed;
    std::size_t others = 0;
    gltf::visit_meshes(scene.document, [&](const json& mesh, const glm::dmat4& to_world) {
        add_splats_of(mesh, to_world, placed, others);
        check_expansion(scene.document.bytes, sizeof(PlacedSplats) * (placed.size() + others),
                        scene.document.where);
    });
    if (placed.empty())
        throw scene.wrong(
            fmt::format("holds no splats: no primitive that is drawn has {}", gltf::kSplats),
            "Name a file with splats.");
    if (others > 0)
        scene.note(fmt::format("{} primitives that are no splats are left out", others));
    return placed;
}

const json* radial_object(const json& primitive) {
    const json& splats = primitive.at("extensions").at(gltf::kSplats);
    if (!splats.contains("extensions")) return nullptr;
    const json& extensions = splats.at("extensions");
    return extensions.contains(gltf::kRadial) ? &extensions.at(gltf::kRadial) : nullptr;
}

/// Everything that identifies the kernel: our extension without its attributes; null where it is
/// absent.
json radial_facts(const json& primitive) {
    const json* object = radial_object(primitive);
    if (!object) return nullptr;
    json facts = *object;
    facts.erase("attributes");
    return facts;
}

/// Finds the kernel by its name, or registers a user's own kernel from its function.
std::optional<int> kernel_of(GltfScene& scene, const std::string& name, const json& facts) {
    if (!facts.contains("function")) return kernel_from_name(name);
    std::vector<std::string> notes;
    const int kernel = register_kernel_of_file(
        definition_from_json({{"name", name}, {"function", facts.at("function")}},
                             scene.document.where),
        scene.document.where, notes);
    for (const std::string& note : notes) scene.note(note);
    return kernel;
}

/// Nothing where this version does not know the kernel; then the fallback is read.
std::optional<RadialKernel> radial_kernel(GltfScene& scene, const json& facts) {
    if (facts.is_null()) return std::nullopt;
    const std::string name = facts.at("kernel").get<std::string>(),
                      footprint = facts.value("footprint", "psi"),
                      mode = facts.value("renderMode", "default");
    const std::optional<int> kernel = kernel_of(scene, name, facts);
    const std::optional<Footprint> known = footprint_from_name(footprint);
    const bool projected =
        kernel && known && (*known != Footprint::exact || has_exact_footprint(*kernel));
    if (projected && (mode == "mip" || mode == "default"))
        return RadialKernel{*kernel, *known, mode == "mip"};
    scene.note(fmt::format("the kernel '{}' ({}, {}) is not known: its nearest Gaussians are read",
                           printable(name), printable(footprint), printable(mode)));
    return std::nullopt;
}

int degree_of(const GltfScene& scene, const json& attributes) {
    int coefficients = 0;
    while (coefficients < 16 && attributes.contains(gltf::harmonic_name(coefficients)))
        ++coefficients;
    int degree = 0;
    while ((degree + 2) * (degree + 2) <= coefficients) ++degree;
    if (coefficients > (degree + 1) * (degree + 1))
        throw scene.wrong(fmt::format("lacks {}", gltf::harmonic_name(coefficients)));
    return degree;
}

void read_colours(GltfScene& scene, const json& attributes, SplatModel& model) {
    const std::string constant = gltf::harmonic_name(0);
    if (const auto dc = attribute(scene, attributes, constant.c_str(), 3, kFloats)) {
        fill(scene, *dc, constant.c_str(), 3, model.sh_dc, kAsItIs);
    } else {
        const std::size_t index = gltf::whole_number(attributes, "COLOR_0");
        const Accessor colour = gltf::find_accessor(scene.document, index, "COLOR_0");
        const unsigned type = bit(colour.type, colour.normalized);
        if (colour.components < 3 || !((kFloats | kUnsignedUnits) & type))
            throw scene.wrong("COLOR_0 is no colour");
        Accessor rgb = colour;
        rgb.components = 3;
        fill(scene, rgb, "COLOR_0", 3, model.sh_dc, dc_of_colour);
        scene.note("there are no harmonics: colours are those of COLOR_0");
    }
    const auto rest = static_cast<std::size_t>(model.rest_count());
    for (std::size_t c = 0; c < rest / 3; ++c) {
        const std::string name = gltf::harmonic_name(static_cast<int>(c) + 1);
        std::vector<float> values(3 * model.size());
        fill(scene, needed(scene, attributes, name.c_str(), 3, kFloats), name.c_str(), 3, values,
             kAsItIs);
        for (std::size_t i = 0; i < model.size(); ++i)
            std::copy_n(&values[3 * i], 3, &model.sh_rest[i * rest + 3 * c]);
    }
}

/// Scales are linear in the extension. Its drafts stored logarithms, which negative numbers reveal.
void read_scales(GltfScene& scene, const json& attributes, SplatModel& model) {
    const Accessor scale =
        needed(scene, attributes, gltf::kScale, 3, kFloats | kSignedUnits | kSigned);
    fill(scene, scale, gltf::kScale, 3, model.log_scale, kAsItIs);
    if (std::ranges::any_of(model.log_scale, [](float value) { return value < 0; })) {
        scene.note("scales are negative: read as logarithms, as drafts of the extension have them");
        return;
    }
    for (float& value : model.log_scale)
        value = limit_infinite_log_scale(static_cast<float>(std::log(double{value})));
}

/// Opacities are 0 to 1 in the extension. Other programs write logits, which lie outside that
/// range.
void read_opacities(GltfScene& scene, const json& attributes, SplatModel& model) {
    const Accessor opacity = needed(scene, attributes, gltf::kOpacity, 1, kFloats | kUnsignedUnits);
    fill(scene, opacity, gltf::kOpacity, 1, model.opacity_logit, kAsItIs);
    constexpr float kRounding = 0.02f;
    if (std::ranges::any_of(model.opacity_logit,
                            [](float v) { return v < -kRounding || v > 1 + kRounding; })) {
        scene.note("opacities lie outside of 0 to 1: read as logits, as 3DGS has them");
        return;
    }
    for (float& value : model.opacity_logit) {
        const double in = std::clamp(double{value}, 0.0, 1.0);
        value = limit_infinite_logit(static_cast<float>(std::log(in) - std::log1p(-in)));
    }
}

void read_fallback(GltfScene& scene, const json& attributes, SplatModel& model) {
    read_scales(scene, attributes, model);
    const Accessor turn = needed(scene, attributes, gltf::kRotation, 4, kFloats | kSignedUnits);
    fill(scene, turn, gltf::kRotation, 4, model.rotation, kAsItIs);
    for (std::size_t i = 0; i < model.rotation.size(); i += 4)  // x y z w
        std::rotate(&model.rotation[i], &model.rotation[i + 3], &model.rotation[i] + 4);
    read_opacities(scene, attributes, model);
}

void read_exact(const GltfScene& scene, const json& radial, SplatModel& model) {
    const json& attributes = radial.at("attributes");
    const auto take = [&](const char* name, int components, std::vector<float>& to) {
        fill(scene, needed(scene, attributes, name, components, kFloats), name,
             static_cast<std::size_t>(components), to, kAsItIs);
    };
    take("LOG_SCALE", 3, model.log_scale);
    take("ROTATION", 4, model.rotation);
    take("OPACITY_LOGIT", 1, model.opacity_logit);
}

void note_properties(GltfScene& scene, const json& splats, bool exact) {
    const auto text = [&](const char* key, const char* otherwise) {
        return splats.value(key, std::string(otherwise));
    };
    if (const std::string kernel = text("kernel", "ellipse"); kernel != "ellipse" && !exact)
        scene.note("the kernel '" + printable(kernel) + "' is not known: drawn with Gaussians");
    if (text("colorSpace", "srgb_rec709_display") != "srgb_rec709_display")
        scene.note("colours are not of sRGB, and are drawn as they are stored");
    if (text("projection", "perspective") != "perspective" ||
        text("sortingMethod", "cameraDistance") != "cameraDistance")
        scene.note(
            "another projection or order of splats is asked for than perspective and the "
            "distance: not followed");
}

/// Throws Error where the node's axes are not at right angles or differ in length.
Similarity similarity_of(const GltfScene& scene, const glm::dmat4& to_world) {
    const glm::dmat3 linear(to_world);
    const double scale = glm::length(linear[0]);
    const glm::dmat3 turn(linear[0] / scale, linear[1] / scale, linear[2] / scale);
    const glm::dmat3 error = glm::transpose(turn) * turn - glm::dmat3(1.0);
    double most = 0;
    for (int k = 0; k < 9; ++k) most = std::max(most, std::abs(error[k / 3][k % 3]));
    if (!(scale > 0) || !(most < kSameLength))
        throw scene.wrong(
            "a node scales its axes differently, or bends them, which splats are not "
            "followed in",
            "Apply the node's transform in the program that made it.");
    glm::dmat3 proper = turn;
    const double mirrored = glm::determinant(turn) < 0 ? -1 : 1;
    proper[0] *= mirrored;
    proper = glm::mat3_cast(glm::normalize(glm::quat_cast(proper)));
    proper[0] *= mirrored;
    return {scale, most == 0 ? turn : proper, glm::dvec3(to_world[3])};
}

SplatModel read_placed(GltfScene& scene, const PlacedSplats& placed,
                       const std::optional<RadialKernel>& exact) {
    const json& attributes = placed.primitive.at("attributes");
    if (gltf::whole_number(placed.primitive, "mode", 4) != 0)
        throw scene.wrong("a primitive with splats is not of points (mode 0)");
    const Accessor positions = needed(scene, attributes, "POSITION", 3, kPositions);
    SplatModel model;
    model.sh_degree = degree_of(scene, attributes);
    model.resize(positions.count);
    fill(scene, positions, "POSITION", 3, model.position, kAsItIs);
    note_properties(scene, placed.primitive.at("extensions").at(gltf::kSplats), exact.has_value());
    read_colours(scene, attributes, model);
    if (exact) {
        model.kernel = exact->kernel;
        model.footprint = exact->footprint;
        model.antialias = exact->antialias;
        read_exact(scene, *radial_object(placed.primitive), model);
        std::vector<std::string> notes;
        settle_shapes(model, notes);
        for (const std::string& note : notes) scene.note(note);
    } else {
        read_fallback(scene, attributes, model);
    }
    model.metres_per_unit =
        positive_number(placed.primitive.value("extras", json()), "metresPerUnit");
    if (glm::dmat3(placed.to_world) != glm::dmat3(1.0))
        transform_splats(similarity_of(scene, placed.to_world), model);
    else
        model.origin = glm::dvec3(placed.to_world[3]);
    return model;
}

/// The kernel that all primitives have in common; nothing, with a note, where they differ.
std::optional<RadialKernel> common_kernel(GltfScene& scene,
                                          const std::vector<PlacedSplats>& placed) {
    const json first = radial_facts(placed[0].primitive);
    for (const PlacedSplats& one : placed)
        if (radial_facts(one.primitive) != first) {
            scene.note("primitives have several kernels: their nearest Gaussians are read");
            return std::nullopt;
        }
    return radial_kernel(scene, first);
}

SplatModel joined(const std::vector<SplatModel>& parts) {
    SplatModel all = parts[0];
    for (const SplatModel& part : parts) all.sh_degree = std::max(all.sh_degree, part.sh_degree);
    for (int a = 0; a < kAttributeCount; ++a) attribute_values(all, a).clear();
    std::vector<double> positions;
    for (const SplatModel& part : parts)
        for (std::size_t i = 0; i < part.size(); ++i) {
            const glm::dvec3 p = position_of(part, i);
            positions.insert(positions.end(), {p.x, p.y, p.z});
            for (int a = 0; a < kAttributeCount; ++a) {
                const std::size_t floats = part.floats(a);
                const auto from =
                    attribute_values(part, a).begin() + static_cast<std::ptrdiff_t>(i * floats);
                std::vector<float>& to = attribute_values(all, a);
                to.insert(to.end(), from, from + static_cast<std::ptrdiff_t>(floats));
                to.resize(to.size() + all.floats(a) - floats);  // harmonics of a higher degree: 0
            }
        }
    set_positions(positions, all);
    return all;
}

SplatModel load_gltf(const SplatSource& source, SplatFile& file) try {
    const Document document = gltf::open_document(source);
    GltfScene scene{document, file};
    const json& asset = document.json.at("asset");
    if (const std::string version = asset.at("version").get<std::string>();
        !version.starts_with("2."))
        throw scene.wrong("is glTF version " + printable(version) + "; 2 is known",
                          "Export it as glTF 2.0.");
    file.version = 2;
    file.bytes = document.bytes;
    file.details = starts_with(source.bytes, "glTF") ? "binary" : "JSON";
    if (asset.contains("generator"))
        file.details += ", by " + asset.at("generator").get<std::string>();
    constexpr const char* kKnown[] = {gltf::kSplats, gltf::kRadial, "KHR_mesh_quantization"};
    gltf::check_extensions(document, kKnown);
    const std::vector<PlacedSplats> placed = placed_splats(scene);
    std::uint64_t splats = 0;
    for (const PlacedSplats& one : placed)
        splats += needed(scene, one.primitive.at("attributes"), "POSITION", 3, kPositions).count;
    check_expansion(document.bytes, 4 * splat_floats(kMaxShDegree) * splats, source.where);
    const std::optional<RadialKernel> exact = common_kernel(scene, placed);
    std::vector<SplatModel> parts;
    for (const PlacedSplats& one : placed) parts.push_back(read_placed(scene, one, exact));
    SplatModel model = parts.size() == 1 && exact ? std::move(parts[0]) : joined(parts);
    file.dropped = drop_non_finite(model);
    return model;
} catch (const json::exception& error) {
    throw Error(source.where, json_reason(error), kCopyAgain);
} catch (const std::out_of_range& error) {
    throw Error(source.where,
                std::string("refers to something that does not exist: ") + error.what(),
                kCopyAgain);
}

// Whether this is a .glb, or JSON that names the extension or is named .gltf.
bool is_gltf(const SplatSource& source) {
    if (starts_with(source.bytes, "glTF")) return true;
    const std::string_view text(reinterpret_cast<const char*>(source.bytes.data()),
                                source.bytes.size());
    const std::size_t first = text.find_first_not_of(" \t\r\n");
    if (first == std::string_view::npos || text[first] != '{') return false;
    return lower(source.where).ends_with(".gltf") ||
           text.find(gltf::kSplats) != std::string_view::npos;
}

}  // namespace

const SplatFormatRow& gltf_format() {
    static const SplatFormatRow row{.name = "glTF",
                                    .endings = {".glb", ".gltf"},
                                    .recognise = is_gltf,
                                    .parse = load_gltf,
                                    .encode = gltf::encode,
                                    .keeps = kKeepsKernel | kKeepsRenderMode | kKeepsHarmonics |
                                             kKeepsDoublePositions | kKeepsUnit,
                                    .cuts = gltf::fallback_losses};
    return row;
}

}  // namespace darb

namespace darb::gltf {

namespace {

using nlohmann::json;

/// Whether darb's own extension is needed, for what KHR_gaussian_splatting cannot store.
bool is_radial(const SplatModel& model) {
    return model.kernel != KERNEL_GAUSSIAN || model.footprint != Footprint::psi ||
           model.antialias || model.origin != glm::dvec3(0.0);
}

void add_shape(const SplatModel& model, Writer& to, json& attributes) {
    const std::size_t count = model.size();
    std::vector<float> scale(3 * count), rotation(4 * count), opacity(count);
    std::ranges::transform(model.log_scale, scale.begin(), [](float value) {
        return static_cast<float>(std::exp(double{drawn_log_scale(value)}));
    });
    for (std::size_t i = 0; i < count; ++i) {
        const float* q = &model.rotation[4 * i];
        double square = 0;
        for (int k = 0; k < 4; ++k) square += double{q[k]} * q[k];
        for (std::size_t k = 0; k < 4; ++k)  // x y z w
            rotation[4 * i + k] = static_cast<float>(q[(k + 1) % 4] / std::sqrt(square));
        opacity[i] = static_cast<float>(sigmoid(model.opacity_logit[i]));
    }
    attributes[kScale] = to.add(scale, 3);
    attributes[kRotation] = to.add(rotation, 4);
    attributes[kOpacity] = to.add(opacity, 1);
}

void add_colours(const SplatModel& model, Writer& to, json& attributes) {
    std::vector<std::uint8_t> colour(4 * model.size());
    for (std::size_t i = 0; i < model.size(); ++i) {
        for (std::size_t k = 0; k < 3; ++k)
            colour[4 * i + k] = nearest_byte(255 * colour_of_dc(model.sh_dc[3 * i + k]));
        colour[4 * i + 3] = byte_of_logit(model.opacity_logit[i]);
    }
    attributes["COLOR_0"] = to.add(colour, 4);
    attributes[harmonic_name(0)] = to.add(model.sh_dc, 3);
    const auto rest = static_cast<std::size_t>(model.rest_count());
    std::vector<float> values(3 * model.size());
    for (std::size_t c = 0; c < rest / 3; ++c) {
        for (std::size_t i = 0; i < model.size(); ++i)
            std::copy_n(&model.sh_rest[i * rest + 3 * c], 3, &values[3 * i]);
        attributes[harmonic_name(static_cast<int>(c) + 1)] = to.add(values, 3);
    }
}

json radial_extension(const SplatModel& model, Writer& to) {
    const json exact = {{"LOG_SCALE", to.add(model.log_scale, 3)},
                        {"ROTATION", to.add(model.rotation, 4)},
                        {"OPACITY_LOGIT", to.add(model.opacity_logit, 1)}};
    json radial = {{"kernel", std::string(kernel_name(model.kernel))},
                   {"footprint", std::string(footprint_name(model.footprint))},
                   {"renderMode", model.antialias ? "mip" : "default"},
                   {"attributes", exact}};
    if (const KernelDefinition* definition = kernel_definition(model.kernel))
        radial["function"] = definition_json(*definition)["function"];
    return radial;
}

json document_of(const SplatModel& model, Writer& to) {
    json attributes, used = json::array({kSplats});
    attributes["POSITION"] = to.add(model.position, 3, bounds_of(model.position));
    add_shape(as_gaussians(model, false), to, attributes);
    add_colours(as_gaussians(model, false), to, attributes);
    json splats = {{"kernel", "ellipse"},
                   {"colorSpace", "srgb_rec709_display"},
                   {"projection", "perspective"},
                   {"sortingMethod", "cameraDistance"}};
    if (is_radial(model)) {
        splats["extensions"] = {{kRadial, radial_extension(model, to)}};
        used.push_back(kRadial);
    }
    json node = node_at(model.origin);
    node["mesh"] = 0;
    json primitive = {{"attributes", attributes}, {"mode", 0}, {"extensions", {{kSplats, splats}}}};
    if (model.metres_per_unit > 0) primitive["extras"] = {{"metresPerUnit", model.metres_per_unit}};
    return {
        {"extensionsUsed", used}, {"nodes", {node}}, {"meshes", {{{"primitives", {primitive}}}}}};
}

void append_bytes(const std::string& text, std::vector<std::byte>& to) {
    const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
    to.insert(to.end(), bytes.begin(), bytes.end());
}

void append_word(std::uint64_t value, std::vector<std::byte>& to) {
    for (int shift = 0; shift < 32; shift += 8)
        to.push_back(static_cast<std::byte>(value >> shift & 255));
}

std::vector<std::byte> glb_of(std::string text, const std::vector<std::byte>& buffer,
                              const std::string& where) {
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const std::uint64_t length = kGlbHeader + 2 * kGlbChunkHeader + text.size() + buffer.size();
    if (length > std::numeric_limits<std::uint32_t>::max())
        throw Error(where, fmt::format("would have {} bytes; a .glb has 4 GiB at most", length),
                    "Write a .gltf, or less.");
    std::vector<std::byte> file;
    file.reserve(length);
    append_word(kGlbMagic, file);
    append_word(2, file);  // version
    append_word(length, file);
    append_word(text.size(), file);
    append_word(kGlbJson, file);
    append_bytes(text, file);
    append_word(buffer.size(), file);
    append_word(kGlbBin, file);
    file.insert(file.end(), buffer.begin(), buffer.end());
    return file;
}

}  // namespace

template <class T>
std::size_t Writer::add(const std::vector<T>& values, int components, json facts) {
    constexpr ComponentType kType = sizeof(T) == 1 ? kUint8 : sizeof(T) == 2 ? kUint16 : kFloat;
    facts["bufferView"] = add_view(std::as_bytes(std::span(values)), {{"target", 34962}});
    facts["componentType"] = static_cast<int>(kType);
    if (kType != kFloat) facts["normalized"] = true;
    facts["count"] = values.size() / static_cast<std::size_t>(components);
    facts["type"] = components == 1 ? "SCALAR" : fmt::format("VEC{}", components);
    accessors.push_back(std::move(facts));
    return accessors.size() - 1;
}
template std::size_t Writer::add(const std::vector<float>&, int, json);
template std::size_t Writer::add(const std::vector<std::uint8_t>&, int, json);
template std::size_t Writer::add(const std::vector<std::uint16_t>&, int, json);

std::size_t Writer::add_indices(std::span<const std::uint32_t> values) {
    const std::size_t view = add_view(std::as_bytes(values), {{"target", 34963}});
    accessors.push_back({{"bufferView", view},
                         {"componentType", static_cast<int>(kUint32)},
                         {"count", values.size()},
                         {"type", "SCALAR"}});
    return accessors.size() - 1;
}

std::size_t Writer::add_view(std::span<const std::byte> bytes, json facts) {
    facts["buffer"] = 0;
    facts["byteOffset"] = buffer.size();
    facts["byteLength"] = bytes.size();
    views.push_back(std::move(facts));
    buffer.insert(buffer.end(), bytes.begin(), bytes.end());
    buffer.resize((buffer.size() + 3) / 4 * 4);
    return views.size() - 1;
}

json bounds_of(const std::vector<float>& position) {
    json low = json::array(), high = json::array();
    for (std::size_t axis = 0; axis < 3; ++axis) {
        float least = std::numeric_limits<float>::infinity(), most = -least;
        for (std::size_t i = axis; i < position.size(); i += 3) {
            least = std::min(least, position[i]);
            most = std::max(most, position[i]);
        }
        low.push_back(least);
        high.push_back(most);
    }
    return {{"min", low}, {"max", high}};
}

json node_at(const glm::dvec3& origin) {
    // Half a turn about x: y down and z forward become y up and z backward.
    json node = {{"rotation", {1, 0, 0, 0}}};
    if (origin != glm::dvec3(0.0)) node["translation"] = {origin.x, -origin.y, -origin.z};
    return node;
}

std::string percent_encoded(const std::string& name) {
    std::string uri;
    for (const char c : name) {
        const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                           (c >= '0' && c <= '9') || c == '-' || c == '_' || c == '.' || c == '~';
        uri += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
    }
    return uri;
}

EncodedSplats pack_document(json document, Writer&& writer, const std::string& where) {
    document["asset"] = {{"version", "2.0"}, {"generator", "darb " DARB_VERSION}};
    document["scene"] = 0;
    document["scenes"] = json::array({json{{"nodes", {0}}}});
    document["accessors"] = std::move(writer.accessors);
    document["bufferViews"] = std::move(writer.views);
    document["buffers"] = json::array({json{{"byteLength", writer.buffer.size()}}});
    const auto text = [&] { return document.dump(-1, ' ', false, json::error_handler_t::replace); };
    if (!lower(where).ends_with(".gltf")) return {glb_of(text(), writer.buffer, where)};
    const std::string name = std::filesystem::path(where).stem().string() + ".bin";
    document["buffers"][0]["uri"] = percent_encoded(name);
    EncodedSplats encoded;
    append_bytes(text(), encoded.file);
    encoded.beside.emplace_back(name, std::move(writer.buffer));
    return encoded;
}

std::vector<std::string> fallback_losses(const SplatModel& model, const std::string&) {
    if (model.kernel == KERNEL_GAUSSIAN) return {};
    const GaussianEquivalent fit = gaussian_equivalent(model.kernel, model.footprint, false);
    return {fmt::format(
        "other programs than darb draw the nearest Gaussians of the kernel {} ({}), covariance x "
        "{:.4f}, opacity x {:.4f}, profile off by {:.2f} % (relative L2)",
        kernel_name(model.kernel), footprint_name(model.footprint), fit.covariance, fit.opacity,
        100 * fit.error)};
}

EncodedSplats encode(const SplatModel& model, const std::string& where, const EncodeOptions&) {
    check_splat_shapes(model);
    if (model.size() == 0)
        throw Error(where, "glTF cannot store a scene without splats", "Write a PLY.");
    Writer writer;
    json document = document_of(model, writer);
    return pack_document(std::move(document), std::move(writer), where);
}

}  // namespace darb::gltf
