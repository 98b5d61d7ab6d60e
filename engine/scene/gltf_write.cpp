#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "engine/core/error.h"
#include "engine/core/text.h"
#include "engine/kernels/kernel_file.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/scene/gaussian_scene.h"
#include "engine/scene/gltf.h"
#include "engine/scene/quantise.h"
#include "engine/scene/splat_shapes.h"

namespace darb::gltf {

namespace {

using nlohmann::json;

/// The buffer and the JSON that describes it, as they grow.
struct GltfWriter {
    std::vector<std::byte> buffer;
    json views = json::array(), accessors = json::array();

    /// [N][components]; returns the accessor's index.
    template <class T>
    std::size_t add(const std::vector<T>& values, int components, json facts = json::object()) {
        constexpr bool kByte = sizeof(T) == 1;
        static_assert(kByte || sizeof(T) == sizeof(float));
        const auto bytes = std::as_bytes(std::span(values));
        views.push_back({{"buffer", 0},
                         {"byteOffset", buffer.size()},
                         {"byteLength", bytes.size()},
                         {"target", 34962}});  // vertex attributes
        buffer.insert(buffer.end(), bytes.begin(), bytes.end());
        buffer.resize((buffer.size() + 3) / 4 * 4);
        facts["bufferView"] = views.size() - 1;
        facts["componentType"] = static_cast<int>(kByte ? kUint8 : kFloat);
        if (kByte) facts["normalized"] = true;
        facts["count"] = values.size() / static_cast<std::size_t>(components);
        facts["type"] = components == 1 ? "SCALAR" : fmt::format("VEC{}", components);
        accessors.push_back(std::move(facts));
        return accessors.size() - 1;
    }
};

/// Whether the extension of our own is needed: for what KHR_gaussian_splatting has no place for.
bool is_radial(const SplatModel& model) {
    return model.kernel != KERNEL_GAUSSIAN || model.footprint != Footprint::psi ||
           model.antialias || model.origin != glm::dvec3(0.0);
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

void add_shape(const SplatModel& model, GltfWriter& to, json& attributes) {
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

void add_colours(const SplatModel& model, GltfWriter& to, json& attributes) {
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

json radial_extension(const SplatModel& model, GltfWriter& to) {
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

json document_of(const SplatModel& model, GltfWriter& to) {
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
    // Half a turn about x: y down and z forward become y up and z backward.
    json node = {{"mesh", 0}, {"rotation", {1, 0, 0, 0}}};
    if (model.origin != glm::dvec3(0.0))
        node["translation"] = {model.origin.x, -model.origin.y, -model.origin.z};
    const json primitive = {
        {"attributes", attributes}, {"mode", 0}, {"extensions", {{kSplats, splats}}}};
    return {{"asset", {{"version", "2.0"}, {"generator", "darb " DARB_VERSION}}},
            {"extensionsUsed", used},
            {"scene", 0},
            {"scenes", {{{"nodes", {0}}}}},
            {"nodes", {node}},
            {"meshes", {{{"primitives", {primitive}}}}},
            {"accessors", to.accessors},
            {"bufferViews", to.views},
            {"buffers", {{{"byteLength", to.buffer.size()}}}}};
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
                    "Write a .gltf, or fewer splats.");
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

std::string percent_encoded(const std::string& name) {
    std::string uri;
    for (const char c : name) {
        const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                           (c >= '0' && c <= '9') || c == '-' || c == '_' || c == '.' || c == '~';
        uri += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
    }
    return uri;
}

}  // namespace

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
        throw Error(where, "glTF has no place for a scene without splats", "Write a PLY.");
    GltfWriter writer;
    json document = document_of(model, writer);
    const auto text = [&] { return document.dump(-1, ' ', false, json::error_handler_t::replace); };
    if (!lower(where).ends_with(".gltf")) return {glb_of(text(), writer.buffer, where)};
    const std::string name = std::filesystem::path(where).stem().string() + ".bin";
    document["buffers"][0]["uri"] = percent_encoded(name);
    EncodedSplats encoded;
    append_bytes(text(), encoded.file);
    encoded.beside.emplace_back(name, std::move(writer.buffer));
    return encoded;
}

}  // namespace darb::gltf
