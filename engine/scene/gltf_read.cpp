#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <optional>

#include "engine/core/error.h"
#include "engine/core/json_text.h"
#include "engine/core/text.h"
#include "engine/kernels/kernel_file.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/gltf.h"
#include "engine/scene/infinite_values.h"
#include "engine/scene/inflate.h"
#include "engine/scene/quantise.h"
#include "engine/scene/splat_shapes.h"

namespace darb {

namespace {

using gltf::Accessor;
using gltf::Document;
using nlohmann::json;

// glTF has y up and z backward; scenes in memory have y down and z forward, as SPZ's are turned.
const glm::dmat4 kFromYUp(1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1);
constexpr double kSameLength = 1e-4;  // of the axes of a node, relative

unsigned bit(gltf::ComponentType type, bool normalized) {
    return 1u << (2 * static_cast<unsigned>(type - gltf::kInt8) + (normalized ? 1u : 0u));
}
// What KHR_gaussian_splatting, and KHR_mesh_quantization of positions, allow.
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

/// What the extension of our own says of a primitive.
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

/// Of an attribute of a primitive, or of our extension's; allowed: bits.
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

/// [N][components], of as many elements as positions there are.
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

/// The nodes that are drawn: those of the scene, or all that are nobody's children.
std::vector<std::size_t> root_nodes(const json& document, std::size_t count) {
    std::vector<std::size_t> roots;
    if (document.contains("scenes") && !document.at("scenes").empty()) {
        const json& scene = document.at("scenes").at(gltf::whole_number(document, "scene", 0));
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

/// Those of a mesh; other primitives are counted.
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
    const json& document = scene.document.json;
    const json none = json::array();
    const json& nodes = document.contains("nodes") ? document.at("nodes") : none;
    struct Visit {
        std::size_t node;
        glm::dmat4 parent;
    };
    std::vector<Visit> stack;
    for (const std::size_t root : root_nodes(document, nodes.size()))
        stack.push_back({root, kFromYUp});
    std::reverse(stack.begin(), stack.end());
    std::vector<bool> seen(nodes.size(), false);
    std::vector<PlacedSplats> placed;
    std::size_t others = 0;
    while (!stack.empty()) {
        const Visit visit = stack.back();
        stack.pop_back();
        const json& node = nodes.at(visit.node);
        if (seen[visit.node])
            throw scene.wrong(fmt::format("node {} is met twice: nodes are no tree", visit.node));
        seen[visit.node] = true;
        const glm::dmat4 to_world = visit.parent * matrix_of(node);
        if (node.contains("mesh"))
            add_splats_of(document.at("meshes").at(gltf::whole_number(node, "mesh")), to_world,
                          placed, others);
        check_expansion(scene.document.bytes, sizeof(PlacedSplats) * (placed.size() + others),
                        scene.document.where);
        for (const json& child : node.value("children", json::array()))
            stack.push_back({child.get<std::size_t>(), to_world});
    }
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

/// All that says which kernel it is: of our extension all but the attributes. null without it.
json radial_facts(const json& primitive) {
    const json* object = radial_object(primitive);
    if (!object) return nullptr;
    json facts = *object;
    facts.erase("attributes");
    return facts;
}

/// By name, or by the function of a kernel of one's own, which is registered.
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

/// Nothing where this version does not know it: the fallback is read.
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

/// Linear, as the extension has them; its drafts stored logarithms, which negative numbers betray.
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

/// 0 to 1, as the extension has them; other programs write logits, which lie outside of that.
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

/// Throws where the node's axes are not at right angles and of one length.
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
    if (glm::dmat3(placed.to_world) != glm::dmat3(1.0))
        transform_splats(similarity_of(scene, placed.to_world), model);
    else
        model.origin = glm::dvec3(placed.to_world[3]);
    return model;
}

/// Where all primitives have the same; nothing, with a note, where they do not.
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

void check_extensions(const GltfScene& scene) {
    constexpr const char* kKnown[] = {gltf::kSplats, gltf::kRadial, "KHR_mesh_quantization"};
    for (const json& one : scene.document.json.value("extensionsRequired", json::array()))
        if (const auto name = one.get<std::string>();
            std::ranges::find(kKnown, name) == std::end(kKnown))
            throw scene.wrong("needs " + printable(name) + ", which is not read",
                              "Export the scene without compression.");
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
    check_extensions(scene);
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
    throw Error(source.where, std::string("names what is not there: ") + error.what(), kCopyAgain);
}

// JSON that says so, or is named .gltf.
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
    static const SplatFormatRow row{
        .name = "glTF",
        .endings = {".glb", ".gltf"},
        .recognise = is_gltf,
        .parse = load_gltf,
        .encode = gltf::encode,
        .keeps = kKeepsKernel | kKeepsRenderMode | kKeepsHarmonics | kKeepsDoublePositions,
        .cuts = gltf::fallback_losses};
    return row;
}

}  // namespace darb
