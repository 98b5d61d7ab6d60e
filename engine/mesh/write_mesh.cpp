// SPDX-License-Identifier: MIT
// The writers of mesh_file.h.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <string_view>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/text.h"
#include "engine/data/image_io.h"
#include "engine/mesh/mesh_file.h"
#include "engine/scene/gltf.h"

namespace darb {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

using Triangle = std::array<std::uint32_t, 3>;

bool has_origin(const TriangleMesh& mesh) {
    return mesh.origin != std::array<double, 3>{};
}

glm::dvec3 world_position(const TriangleMesh& mesh, std::size_t vertex) {
    return glm::dvec3(mesh.origin[0], mesh.origin[1], mesh.origin[2]) +
           glm::dvec3(mesh.position[vertex]);
}

void append_text(std::string_view text, std::vector<std::byte>& to) {
    const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
    to.insert(to.end(), bytes.begin(), bytes.end());
}

std::vector<std::byte> bytes_of_text(const fmt::memory_buffer& text) {
    std::vector<std::byte> bytes;
    append_text({text.data(), text.size()}, bytes);
    return bytes;
}

/// Rows of a binary PLY.
struct RowWriter {
    std::vector<std::byte>& to;
    template <class T>
    void put(T value) {
        const auto bytes = std::as_bytes(std::span(&value, 1));
        to.insert(to.end(), bytes.begin(), bytes.end());
    }
};

std::vector<std::byte> encode_ply_mesh(const TriangleMesh& mesh) {
    const char* coordinate = has_origin(mesh) ? "double" : "float";
    std::string header = "ply\nformat binary_little_endian 1.0\ncomment darb " DARB_VERSION "\n";
    header += fmt::format("element vertex {}\n", mesh.vertex_count());
    for (const char axis : {'x', 'y', 'z'})
        header += fmt::format("property {} {}\n", coordinate, axis);
    if (!mesh.normal.empty()) header += "property float nx\nproperty float ny\nproperty float nz\n";
    if (!mesh.colour.empty())
        header += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    if (mesh.face_count() > 0)
        header += fmt::format("element face {}\nproperty list uchar int vertex_indices\n",
                              mesh.face_count());
    std::vector<std::byte> file;
    file.reserve(header.size() + 40 * mesh.vertex_count() + 13 * mesh.face_count());
    append_text(header + "end_header\n", file);
    RowWriter row{file};
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
        if (has_origin(mesh))
            row.put(world_position(mesh, v));
        else
            row.put(mesh.position[v]);
        if (!mesh.normal.empty()) row.put(mesh.normal[v]);
        if (!mesh.colour.empty()) row.put(mesh.colour[v]);
    }
    for (const Triangle& face : mesh.face) {
        row.put(std::uint8_t{3});
        row.put(face);
    }
    return file;
}

/// Vertices of a textured mesh: one for each place that a vertex has on the pages.
struct PlacedVertices {
    std::vector<std::uint32_t> vertex;  // [P] of the mesh
    std::vector<glm::vec2> uv;          // [P]
    std::vector<Triangle> face;         // [F] of places
};

PlacedVertices place_vertices(const TriangleMesh& mesh, const MeshTexture& texture) {
    constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
    PlacedVertices placed;
    placed.face.resize(mesh.face_count());
    std::vector<std::uint32_t> first(mesh.vertex_count(), kNone), next, page;
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        for (std::size_t c = 0; c < 3; ++c) {
            const std::uint32_t vertex = mesh.face[f][c];
            std::uint32_t* at = &first[vertex];
            while (*at != kNone &&
                   (placed.uv[*at] != texture.uv[f][c] || page[*at] != texture.page[f]))
                at = &next[*at];
            if (*at == kNone) {
                const auto place = static_cast<std::uint32_t>(placed.vertex.size());
                *at = place;  // before `next` grows, which holds it
                placed.vertex.push_back(vertex);
                placed.uv.push_back(texture.uv[f][c]);
                page.push_back(texture.page[f]);
                next.push_back(kNone);
                placed.face[f][c] = place;
            } else {
                placed.face[f][c] = *at;
            }
        }
    return placed;
}

/// Pages as files, named after the mesh's.
struct Page {
    std::string name;
    const char* mime;
    std::vector<std::byte> bytes;
};

std::vector<Page> encode_pages(const MeshTexture& texture, const std::string& where,
                               const MeshFileOptions& options) {
    const bool jpeg = options.jpeg_quality > 0;
    std::vector<Page> pages;
    for (std::size_t i = 0; i < texture.image.size(); ++i)
        pages.push_back(
            {fmt::format("{}_{}.{}", fs::path(where).stem().string(), i, jpeg ? "jpg" : "png"),
             jpeg ? "image/jpeg" : "image/png",
             jpeg ? encode_jpeg(texture.image[i], options.jpeg_quality)
                  : encode_png(texture.image[i])});
    return pages;
}

void put_obj_vertices(const TriangleMesh& mesh, fmt::memory_buffer& text) {
    const auto out = std::back_inserter(text);
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
        if (has_origin(mesh)) {
            const glm::dvec3 p = world_position(mesh, v);
            fmt::format_to(out, "v {} {} {}", p.x, p.y, p.z);
        } else {
            const glm::vec3 p = mesh.position[v];
            fmt::format_to(out, "v {} {} {}", p.x, p.y, p.z);
        }
        if (!mesh.colour.empty()) {  // the customary extension, which most programs read
            const glm::u8vec3 c = mesh.colour[v];
            fmt::format_to(out, " {:.4f} {:.4f} {:.4f}", c.x / 255.0, c.y / 255.0, c.z / 255.0);
        }
        fmt::format_to(out, "\n");
    }
    for (const glm::vec3& n : mesh.normal) fmt::format_to(out, "vn {} {} {}\n", n.x, n.y, n.z);
}

EncodedSplats encode_obj_mesh(const TriangleMesh& mesh, const std::string& where,
                              const MeshTexture* texture, const MeshFileOptions& options) {
    const std::string stem = fs::path(where).stem().string();
    fmt::memory_buffer text;
    const auto out = std::back_inserter(text);
    fmt::format_to(out, "# darb " DARB_VERSION "\n");
    if (texture) fmt::format_to(out, "mtllib {}.mtl\n", stem);
    put_obj_vertices(mesh, text);
    PlacedVertices placed;
    if (texture) placed = place_vertices(mesh, *texture);
    for (const glm::vec2& uv : placed.uv) fmt::format_to(out, "vt {} {}\n", uv.x, 1 - uv.y);
    const auto put_face = [&](std::size_t f) {
        fmt::format_to(out, "f");
        for (std::size_t c = 0; c < 3; ++c) {
            const std::uint32_t v = mesh.face[f][c] + 1;
            fmt::format_to(out, " {}", v);
            if (texture) fmt::format_to(out, "/{}", placed.face[f][c] + 1);
            if (!mesh.normal.empty()) fmt::format_to(out, "{}/{}", texture ? "" : "/", v);
        }
        fmt::format_to(out, "\n");
    };
    if (!texture) {
        for (std::size_t f = 0; f < mesh.face_count(); ++f) put_face(f);
        return {bytes_of_text(text)};
    }
    EncodedSplats encoded;
    std::string materials;
    std::vector<Page> pages = encode_pages(*texture, where, options);
    for (std::size_t page = 0; page < pages.size(); ++page) {
        materials += fmt::format("newmtl page_{}\nKa 0 0 0\nKd 1 1 1\nillum 0\nmap_Kd {}\n", page,
                                 pages[page].name);
        fmt::format_to(out, "usemtl page_{}\n", page);
        for (std::size_t f = 0; f < mesh.face_count(); ++f)
            if (texture->page[f] == page) put_face(f);
        encoded.beside.emplace_back(std::move(pages[page].name), std::move(pages[page].bytes));
    }
    std::vector<std::byte> bytes;
    append_text(materials, bytes);
    encoded.beside.emplace_back(stem + ".mtl", std::move(bytes));
    encoded.file = bytes_of_text(text);
    return encoded;
}

/// sRGB bytes as glTF wants colours of vertices: linear; 16 bits, so that no two bytes fall
/// together.
std::vector<std::uint16_t> linear_colours(const std::vector<glm::u8vec3>& colour) {
    std::array<std::uint16_t, 256> table;
    for (std::size_t i = 0; i < table.size(); ++i) {
        const double s = static_cast<double>(i) / 255;
        const double linear = s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
        table[i] = static_cast<std::uint16_t>(std::lround(65535 * linear));
    }
    std::vector<std::uint16_t> values;
    values.reserve(4 * colour.size());
    for (const glm::u8vec3& c : colour)
        values.insert(values.end(), {table[c.x], table[c.y], table[c.z], 65535});
    return values;
}

template <class V>
std::vector<float> floats_of(const std::vector<V>& values) {
    std::vector<float> floats;
    floats.reserve(values.size() * static_cast<std::size_t>(V::length()));
    for (const V& value : values)
        for (int c = 0; c < V::length(); ++c) floats.push_back(value[c]);
    return floats;
}

/// The rows of `values` that `at` names; all of them where there is no `at`.
template <class T>
std::vector<T> picked(const std::vector<T>& values, const std::vector<std::uint32_t>* at) {
    if (!at || values.empty()) return values;
    std::vector<T> rows;
    rows.reserve(at->size());
    for (const std::uint32_t i : *at) rows.push_back(values[i]);
    return rows;
}

/// Colours are those of the photos, light included: nothing is to shine on them again.
json unlit_material() {
    return {{"extensions", {{"KHR_materials_unlit", json::object()}}},
            {"doubleSided", true},
            {"pbrMetallicRoughness", {{"metallicFactor", 0.0}, {"roughnessFactor", 1.0}}}};
}

json primitive_of(const json& attributes, int material) {
    return {{"attributes", attributes}, {"material", material}};
}

void put_pages(const std::vector<Page>& pages, bool within, gltf::Writer& writer, json& document) {
    json images = json::array(), textures = json::array(), materials = json::array();
    for (std::size_t i = 0; i < pages.size(); ++i) {
        if (within)
            images.push_back(
                {{"mimeType", pages[i].mime}, {"bufferView", writer.add_view(pages[i].bytes)}});
        else
            images.push_back({{"uri", gltf::percent_encoded(pages[i].name)}});
        textures.push_back({{"source", i}, {"sampler", 0}});
        json material = unlit_material();
        material["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", i}};
        materials.push_back(std::move(material));
    }
    document["images"] = std::move(images);
    document["textures"] = std::move(textures);
    document["materials"] = std::move(materials);
    // Linear, and clamped at the borders of pages.
    document["samplers"] = json::array(
        {json{{"magFilter", 9729}, {"minFilter", 9987}, {"wrapS", 33071}, {"wrapT", 33071}}});
}

std::vector<std::uint32_t> indices_of_page(const std::vector<Triangle>& face,
                                           const std::vector<std::uint32_t>* page,
                                           std::size_t wanted) {
    std::vector<std::uint32_t> indices;
    for (std::size_t f = 0; f < face.size(); ++f)
        if (!page || (*page)[f] == wanted)
            indices.insert(indices.end(), face[f].begin(), face[f].end());
    return indices;
}

EncodedSplats encode_gltf_mesh(const TriangleMesh& mesh, const std::string& where,
                               const MeshTexture* texture, const MeshFileOptions& options) {
    gltf::Writer writer;
    json document, attributes, primitives = json::array();
    PlacedVertices placed;
    if (texture) placed = place_vertices(mesh, *texture);
    const auto* at = texture ? &placed.vertex : nullptr;
    const std::vector<float> position = floats_of(picked(mesh.position, at));
    attributes["POSITION"] = writer.add(position, 3, gltf::bounds_of(position));
    if (!mesh.normal.empty())
        attributes["NORMAL"] = writer.add(floats_of(picked(mesh.normal, at)), 3);
    if (!mesh.colour.empty() && !texture)
        attributes["COLOR_0"] = writer.add(linear_colours(mesh.colour), 4);
    if (texture) attributes["TEXCOORD_0"] = writer.add(floats_of(placed.uv), 2);
    std::vector<Page> pages;
    if (texture) pages = encode_pages(*texture, where, options);
    const bool within = !lower(where).ends_with(".gltf");
    if (texture)
        put_pages(pages, within, writer, document);
    else
        document["materials"] = json::array({unlit_material()});
    if (mesh.colour.empty() && !texture)
        document["materials"][0].erase("extensions");  // a plain shape needs light to be seen
    else
        document["extensionsUsed"] = json::array({"KHR_materials_unlit"});
    for (std::size_t page = 0; page < std::max<std::size_t>(1, pages.size()); ++page) {
        json primitive = primitive_of(attributes, static_cast<int>(page));
        if (mesh.face_count() == 0) primitive["mode"] = 0;
        const auto indices = indices_of_page(texture ? placed.face : mesh.face,
                                             texture ? &texture->page : nullptr, page);
        if (!indices.empty()) primitive["indices"] = writer.add_indices(indices);
        if (!indices.empty() || mesh.face_count() == 0) primitives.push_back(std::move(primitive));
    }
    json node = gltf::node_at({mesh.origin[0], mesh.origin[1], mesh.origin[2]});
    node["mesh"] = 0;
    document["nodes"] = json::array({node});
    document["meshes"] = json::array({json{{"primitives", primitives}}});
    EncodedSplats encoded = gltf::pack_document(std::move(document), std::move(writer), where);
    if (!within)
        for (Page& page : pages)
            encoded.beside.emplace_back(std::move(page.name), std::move(page.bytes));
    return encoded;
}

void check_arrays(const TriangleMesh& mesh, const MeshTexture* texture) {
    const std::size_t vertices = mesh.vertex_count();
    DARB_CHECK(mesh.normal.empty() || mesh.normal.size() == vertices, "{} normals for {} vertices",
               mesh.normal.size(), vertices);
    DARB_CHECK(mesh.colour.empty() || mesh.colour.size() == vertices, "{} colours for {} vertices",
               mesh.colour.size(), vertices);
    if (!texture) return;
    DARB_CHECK(texture->uv.size() == mesh.face_count() && texture->page.size() == mesh.face_count(),
               "{} and {} for {} faces", texture->uv.size(), texture->page.size(),
               mesh.face_count());
}

}  // namespace

std::string mesh_endings() {
    return ".ply, .obj, .glb, .gltf";
}

EncodedSplats encode_mesh(const TriangleMesh& mesh, const std::string& where,
                          const MeshTexture* texture, const MeshFileOptions& options) {
    check_arrays(mesh, texture);
    if (mesh.vertex_count() == 0)
        throw Error(where, "there is no vertex to write: the mesh is empty",
                    "Make one with more faces: a larger --voxel, or a smaller --min-island.");
    const fs::path path = where;
    if (has_extension(path, ".ply")) {
        if (texture)
            throw Error(where, "a .ply has no place for a texture",
                        "Write .glb, .gltf or .obj, or take --texture vertex.");
        return {encode_ply_mesh(mesh)};
    }
    if (has_extension(path, ".obj")) return encode_obj_mesh(mesh, where, texture, options);
    if (has_extension(path, ".glb") || has_extension(path, ".gltf"))
        return encode_gltf_mesh(mesh, where, texture, options);
    throw Error(where, "has no ending of a mesh that is known here",
                "Give it one of " + mesh_endings() + ".");
}

void write_mesh(const fs::path& path, const TriangleMesh& mesh, const MeshTexture* texture,
                const MeshFileOptions& options) {
    write_encoded(path, encode_mesh(mesh, path.string(), texture, options));
}

}  // namespace darb
