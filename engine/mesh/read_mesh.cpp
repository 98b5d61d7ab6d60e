// SPDX-License-Identifier: MIT
// The readers of mesh_file.h.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/json_text.h"
#include "engine/core/parse_number.h"
#include "engine/core/text.h"
#include "engine/data/image_io.h"
#include "engine/mesh/mesh_file.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/gltf.h"
#include "engine/scene/inflate.h"
#include "engine/scene/ply_table.h"

namespace darb {

namespace {

using nlohmann::json;
using Bytes = std::span<const std::byte>;
namespace fs = std::filesystem;

/// What a file gives, in double and before it is known whether all of it can be taken.
class MeshBuilder {
  public:
    MeshBuilder(const std::string& where, std::vector<std::string>* notes)
        : where_(where), notes_(notes) {}

    std::vector<double> position;     // [V][3] world
    std::vector<glm::vec3> normal;    // [V] or empty
    std::vector<glm::u8vec3> colour;  // [V] or empty
    std::size_t vertices() const { return position.size() / 3; }
    std::size_t faces() const { return face_.size(); }

    void note(const std::string& text) const {
        if (notes_) notes_->push_back(where_ + ": " + text);
    }

    /// Adds a triangle, or a polygon as the fan around the first corner that gives one.
    /// place: of the face in the file, for errors.
    void add_face(std::span<const std::uint32_t> corner, const std::string& place) {
        if (corner.size() < 3)
            throw Error(where_, fmt::format("{} has {} corners", place, corner.size()),
                        "Remove lines and points from the mesh, or export it as triangles.");
        for (const std::uint32_t c : corner)
            if (c >= vertices())
                throw Error(where_, fmt::format("{} names vertex {} of {}", place, c, vertices()),
                            kCopyAgain);
        const std::size_t n = corner.size();
        const std::size_t from = n == 3 ? 0 : fan_start(corner, place);
        for (std::size_t i = 1; i + 1 < n; ++i)
            face_.push_back({corner[from], corner[(from + i) % n], corner[(from + i + 1) % n]});
    }

    TriangleMesh finish() {
        if (vertices() == 0)
            throw Error(where_, "has no vertices", "Name a file with a mesh or with points.");
        drop_or_refuse_infinite();
        TriangleMesh mesh;
        const glm::dvec3 origin = origin_for_float32(position);
        mesh.origin = {origin.x, origin.y, origin.z};
        mesh.position.resize(vertices());
        for (std::size_t v = 0; v < vertices(); ++v) {
            mesh.position[v] = glm::vec3(point(v) - origin);
            if (const glm::vec3 p = mesh.position[v]; !std::isfinite(p.x + p.y + p.z))
                throw Error(where_, fmt::format("vertex {} is too far away", v),
                            "Move the mesh to where the scene is.");
        }
        mesh.normal = unit_normals();
        mesh.colour = std::move(colour);
        mesh.face = std::move(face_);
        return mesh;
    }

  private:
    glm::dvec3 point(std::size_t v) const {
        return {position[3 * v], position[3 * v + 1], position[3 * v + 2]};
    }

    /// The corner from which all triangles of the fan turn as the polygon does.
    std::size_t fan_start(std::span<const std::uint32_t> corner, const std::string& place) const {
        constexpr std::size_t kMostTried = 64;
        const std::size_t n = corner.size();
        const glm::dvec3 first = point(corner[0]);
        const auto at = [&](std::size_t i) { return point(corner[i % n]) - first; };
        glm::dvec3 area(0.0);  // twice the polygon's, as a vector
        for (std::size_t i = 1; i + 1 < n; ++i) area += glm::cross(at(i), at(i + 1));
        const double least = -1e-9 * glm::dot(area, area);
        for (std::size_t from = 0; from < std::min(n, kMostTried); ++from) {
            bool turns = true;
            for (std::size_t i = 1; turns && i + 1 < n; ++i) {
                const glm::dvec3 a = at(from + i) - at(from), b = at(from + i + 1) - at(from);
                turns = !(glm::dot(glm::cross(a, b), area) < least);
            }
            if (turns) return from;
        }
        throw Error(where_,
                    fmt::format("{} is a polygon of {} corners that is not convex", place, n),
                    "Triangulate the mesh in the program that made it.");
    }

    /// Points without a place are left out; a mesh cannot lose a vertex.
    void drop_or_refuse_infinite() {
        std::size_t kept = 0;
        for (std::size_t v = 0; v < vertices(); ++v) {
            const glm::dvec3 p = point(v);
            const bool finite = std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
            if (!finite && !face_.empty())
                throw Error(where_, fmt::format("vertex {} is not finite", v), kCopyAgain);
            if (!finite) continue;
            for (int c = 0; c < 3; ++c) position[3 * kept + static_cast<std::size_t>(c)] = p[c];
            if (!normal.empty()) normal[kept] = normal[v];
            if (!colour.empty()) colour[kept] = colour[v];
            ++kept;
        }
        if (kept == vertices()) return;
        note(fmt::format("{} points that are not finite are left out", vertices() - kept));
        position.resize(3 * kept);
        if (!normal.empty()) normal.resize(kept);
        if (!colour.empty()) colour.resize(kept);
        if (kept == 0) throw Error(where_, "has no finite point", kCopyAgain);
    }

    std::vector<glm::vec3> unit_normals() {
        for (glm::vec3& n : normal) {
            const float length = glm::length(n);
            if (!(length > 0) || !std::isfinite(length)) {
                note("some of its normals have no direction: all are left out");
                return {};
            }
            n /= length;
        }
        return std::move(normal);
    }

    const std::string& where_;
    std::vector<std::string>* notes_;
    std::vector<std::array<std::uint32_t, 3>> face_;
};

// PLY.

bool is_floating(const PlyProperty& property) {
    return property.type == PlyType::float32 || property.type == PlyType::float64;
}

void read_ply_vertices(Bytes file, const PlyHeader& header, const PlyElement& vertex,
                       const std::string& where, MeshBuilder& mesh) {
    int at[9];
    constexpr const char* kNames[9] = {"x", "y", "z", "nx", "ny", "nz", "red", "green", "blue"};
    for (int i = 0; i < 9; ++i) at[i] = vertex.find(kNames[i]);
    for (int i = 0; i < 3; ++i)
        if (at[i] < 0)
            throw Error(where, fmt::format("element vertex lacks the property {}", kNames[i]),
                        "A mesh or a point cloud is needed.");
    const bool normals = at[3] >= 0 && at[4] >= 0 && at[5] >= 0;
    const bool colours = at[6] >= 0 && at[7] >= 0 && at[8] >= 0;
    const double unit =
        colours && is_floating(vertex.properties[static_cast<std::size_t>(at[6])]) ? 255 : 1;
    check_ply_size(file, header, vertex, where);
    mesh.position.reserve(3 * vertex.count);
    read_ply_rows(file, header, vertex, where, [&](std::size_t, const double* row) {
        mesh.position.insert(mesh.position.end(), {row[at[0]], row[at[1]], row[at[2]]});
        if (normals) mesh.normal.emplace_back(row[at[3]], row[at[4]], row[at[5]]);
        if (!colours) return;
        glm::u8vec3 colour;
        for (int c = 0; c < 3; ++c) {
            const double value = unit * row[at[6 + c]];
            colour[c] = static_cast<std::uint8_t>(
                std::isfinite(value) ? std::lround(std::clamp(value, 0.0, 255.0)) : 0);
        }
        mesh.colour.push_back(colour);
    });
}

void read_ply_faces(Bytes file, const PlyHeader& header, const PlyElement& face,
                    const std::string& where, MeshBuilder& mesh) {
    const int named = std::max(face.find("vertex_indices"), face.find("vertex_index"));
    if (named < 0 || !face.properties[static_cast<std::size_t>(named)].is_list)
        throw Error(where, "element face has no list vertex_indices",
                    "Export the mesh with faces as lists of vertices.");
    std::vector<std::uint32_t> corner;
    read_ply_rows(
        file, header, face, where, [](std::size_t, const double*) {}, {},
        [&](std::size_t row, std::size_t column, std::span<const double> values) {
            if (column != static_cast<std::size_t>(named)) return;
            corner.clear();
            for (const double value : values) {
                if (!(value >= 0) || value > 4294967295.0 || value != std::floor(value))
                    throw Error(where, fmt::format("face {} names vertex {}", row, value),
                                kCopyAgain);
                corner.push_back(static_cast<std::uint32_t>(value));
            }
            mesh.add_face(corner, fmt::format("face {}", row));
        });
}

void read_ply_mesh(Bytes file, const std::string& where, MeshBuilder& mesh) {
    const PlyHeader header = parse_ply_header(file, where);
    const PlyElement* vertex = header.find("vertex");
    if (!vertex) throw Error(where, "has no element vertex", "A mesh or a point cloud is needed.");
    read_ply_vertices(file, header, *vertex, where, mesh);
    if (const PlyElement* strips = header.find("tristrips"); strips && strips->count > 0)
        throw Error(where, "has strips of triangles, which are not read",
                    "Export it with an element face.");
    if (const PlyElement* face = header.find("face"); face && face->count > 0)
        read_ply_faces(file, header, *face, where, mesh);
}

// OBJ.

class ObjReader {
  public:
    ObjReader(std::string_view text, const std::string& where, MeshBuilder& mesh)
        : text_(text), where_(where), mesh_(mesh) {}

    void read() {
        while (!text_.empty()) {
            ++line_;
            next_line();
            const std::string_view key = next_word();
            if (key == "v") read_vertex();
            if (key == "vn") read_normal();
            if (key == "f") read_face();
        }
        sum_.resize(mesh_.vertices(), glm::vec3(0.0f));
        if (normals_found_) mesh_.normal = std::move(sum_);
        if (mesh_.colour.size() != mesh_.vertices()) mesh_.colour.clear();
    }

  private:
    [[noreturn]] void fail(const std::string& reason) const {
        throw Error(where_, fmt::format("line {}: {}", line_, reason), kCopyAgain);
    }

    /// One line, with those that a backslash at its end joins to it.
    void next_line() {
        joined_.clear();
        for (bool more = true; more;) {
            const std::size_t end = std::min(text_.find('\n'), text_.size());
            std::string_view part = text_.substr(0, end);
            text_.remove_prefix(std::min(end + 1, text_.size()));
            while (part.ends_with('\r') || part.ends_with(' ')) part.remove_suffix(1);
            more = part.ends_with('\\') && !text_.empty();
            if (part.ends_with('\\')) part.remove_suffix(1);
            joined_ += part;
            if (more) joined_ += ' ';
        }
        rest_ = joined_;
    }

    std::string_view next_word() {
        const std::size_t begin = rest_.find_first_not_of(" \t");
        if (begin == std::string_view::npos) return rest_ = {};
        const std::size_t end = std::min(rest_.find_first_of(" \t", begin), rest_.size());
        const std::string_view word = rest_.substr(begin, end - begin);
        rest_.remove_prefix(end);
        return word;
    }

    double number(std::string_view word) const {
        double value = 0;
        const auto [end, error] = parse_number(word.data(), word.data() + word.size(), value);
        if (error == std::errc::invalid_argument || end != word.data() + word.size())
            fail(fmt::format("'{}' is not a number", printable(word.substr(0, 40))));
        return value;  // 0 where it is beyond double
    }

    void read_vertex() {
        double values[8];
        std::size_t count = 0;
        for (auto word = next_word(); !word.empty() && count < 8; word = next_word())
            values[count++] = number(word);
        if (count < 3) fail(fmt::format("a vertex has {} coordinates", count));
        mesh_.position.insert(mesh_.position.end(), values, values + 3);
        if (count < 6) return;  // x y z and maybe w
        glm::u8vec3 colour;
        for (int c = 0; c < 3; ++c)
            colour[c] = static_cast<std::uint8_t>(std::lround(
                255 * std::clamp(values[count - 3 + static_cast<std::size_t>(c)], 0.0, 1.0)));
        mesh_.colour.push_back(colour);
    }

    void read_normal() {
        glm::dvec3 n;
        for (int c = 0; c < 3; ++c) n[c] = number(next_word());
        normals_.emplace_back(n);
    }

    /// The index of a word such as 3, -1: from the first or back from the last of `count`.
    std::uint32_t index(std::string_view word, std::size_t count, const char* what) const {
        long long value = 0;
        const auto [end, error] = parse_number(word.data(), word.data() + word.size(), value);
        if (error != std::errc{} || end != word.data() + word.size())
            fail(fmt::format("'{}' names no {}", printable(word.substr(0, 40)), what));
        const long long at = value < 0 ? static_cast<long long>(count) + value : value - 1;
        if (at < 0 || at >= static_cast<long long>(count))
            fail(fmt::format("names {} {} of {}", what, value, count));
        return static_cast<std::uint32_t>(at);
    }

    void read_face() {
        corner_.clear();
        for (auto word = next_word(); !word.empty(); word = next_word()) {
            const std::size_t slash = std::min(word.find('/'), word.size());
            corner_.push_back(index(word.substr(0, slash), mesh_.vertices(), "vertex"));
            const std::size_t last = word.rfind('/');
            if (slash == word.size() || last == slash || last + 1 == word.size()) continue;
            const std::uint32_t n = index(word.substr(last + 1), normals_.size(), "normal");
            // A vertex has one normal here: the mean of those that its faces give it.
            sum_.resize(mesh_.vertices(), glm::vec3(0.0f));
            sum_[corner_.back()] += normals_[n];
            normals_found_ = true;
        }
        mesh_.add_face(corner_, fmt::format("line {}: the face", line_));
    }

    std::string_view text_, rest_;
    std::string joined_;
    const std::string& where_;
    MeshBuilder& mesh_;
    std::size_t line_ = 0;
    bool normals_found_ = false;
    std::vector<glm::vec3> normals_, sum_;
    std::vector<std::uint32_t> corner_;
};

// glTF.

class GltfMeshReader {
  public:
    GltfMeshReader(const gltf::Document& document, const MeshReadOptions& options,
                   MeshBuilder& mesh)
        : document_(document), options_(options), mesh_(mesh) {}

    void read() {
        constexpr const char* kKnown[] = {"KHR_mesh_quantization", "KHR_materials_unlit",
                                          "KHR_texture_transform", gltf::kSplats};
        gltf::check_extensions(document_, kKnown);
        gltf::visit_meshes(document_, [&](const json& mesh, const glm::dmat4& to_world) {
            for (const json& primitive : mesh.at("primitives")) add(primitive, to_world);
        });
        if (lines_ > 0) mesh_.note(fmt::format("{} primitives of lines are left out", lines_));
        if (mesh_.normal.size() != mesh_.vertices()) mesh_.normal.clear();
        if (mesh_.colour.size() != mesh_.vertices()) mesh_.colour.clear();
    }

  private:
    Error wrong(const std::string& reason, const std::string& hint = kCopyAgain) const {
        return {document_.where, fmt::format("primitive {}: {}", primitive_, reason), hint};
    }

    std::optional<gltf::Accessor> attribute(const json& primitive, const char* name,
                                            int components) const {
        const json& attributes = primitive.at("attributes");
        if (!attributes.contains(name)) return std::nullopt;
        gltf::Accessor found =
            gltf::find_accessor(document_, gltf::whole_number(attributes, name), name);
        if (found.components < components)
            throw wrong(fmt::format("{} has {} components", name, found.components));
        return found;
    }

    void add(const json& primitive, const glm::dmat4& to_world) {
        ++primitive_;
        const std::size_t mode = gltf::whole_number(primitive, "mode", 4);
        if (mode == 5 || mode == 6)
            throw wrong("has strips or fans of triangles, which are not read",
                        "Export it as triangles.");
        if (mode != 4 && mode != 0) {
            ++lines_;
            return;
        }
        const auto position = attribute(primitive, "POSITION", 3);
        if (!position) throw wrong("has no POSITION");
        const std::size_t first = mesh_.vertices();
        check_expansion(document_.bytes, 40 * (first + position->count) + 12 * mesh_.faces(),
                        document_.where);
        for (std::size_t i = 0; i < position->count; ++i) {
            const glm::dvec4 p(position->value(i, 0), position->value(i, 1), position->value(i, 2),
                               1.0);
            const glm::dvec4 world = to_world * p;
            mesh_.position.insert(mesh_.position.end(), {world.x, world.y, world.z});
        }
        add_normals(primitive, to_world, position->count);
        add_colours(primitive, position->count);
        if (mode == 4)
            add_faces(primitive, first, position->count,
                      glm::determinant(glm::dmat3(to_world)) < 0);
    }

    void add_normals(const json& primitive, const glm::dmat4& to_world, std::size_t count) {
        const auto normal = attribute(primitive, "NORMAL", 3);
        if (!normal || normal->count != count) return;
        const glm::dmat3 turn = glm::transpose(glm::inverse(glm::dmat3(to_world)));
        for (std::size_t i = 0; i < count; ++i)
            mesh_.normal.emplace_back(
                turn * glm::dvec3(normal->value(i, 0), normal->value(i, 1), normal->value(i, 2)));
    }

    void add_colours(const json& primitive, std::size_t count) {
        const auto colour = attribute(primitive, "COLOR_0", 3);
        if (!colour && options_.colours_of_textures)
            return add_colours_of_texture(primitive, count);
        if (!colour || colour->count != count) return;
        for (std::size_t i = 0; i < count; ++i) {
            glm::u8vec3 srgb;
            for (int c = 0; c < 3; ++c) {
                const double given = colour->value(i, c);
                const double linear = std::isfinite(given) ? std::clamp(given, 0.0, 1.0) : 0.0;
                const double s = linear <= 0.0031308 ? 12.92 * linear
                                                     : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
                srgb[c] = static_cast<std::uint8_t>(std::lround(255 * s));
            }
            mesh_.colour.push_back(srgb);
        }
    }

    /// The picture of the primitive's base colour and the name of its places; null where it has
    /// none in the file's own buffers.
    const ImageU8* texture_of(const json& primitive, std::string& places) {
        if (!primitive.contains("material")) return nullptr;
        const json& material =
            document_.json.at("materials").at(gltf::whole_number(primitive, "material"));
        const json base = material.value("pbrMetallicRoughness", json::object())
                              .value("baseColorTexture", json::object());
        if (!base.contains("index")) return nullptr;
        places = fmt::format("TEXCOORD_{}", gltf::whole_number(base, "texCoord", 0));
        const json& texture = document_.json.at("textures").at(gltf::whole_number(base, "index"));
        const std::size_t index = gltf::whole_number(texture, "source");
        const json& image = document_.json.at("images").at(index);
        if (!image.contains("bufferView")) return nullptr;
        const auto known = images_.find(index);
        if (known != images_.end()) return &known->second;
        const json& view =
            document_.json.at("bufferViews").at(gltf::whole_number(image, "bufferView"));
        const std::vector<std::byte>& buffer =
            document_.buffers.at(gltf::whole_number(view, "buffer"));
        const std::size_t at = gltf::whole_number(view, "byteOffset", 0),
                          bytes = gltf::whole_number(view, "byteLength");
        if (at > buffer.size() || bytes > buffer.size() - at)
            throw wrong("its picture does not lie within its buffer");
        const Bytes file = std::span(buffer).subspan(at, bytes);
        const std::string where = fmt::format("{}, image {}", document_.where, index);
        const ImageInfo info = parse_image_info(file, where);
        check_expansion(bytes, 4 * std::uint64_t(info.width) * std::uint64_t(info.height), where);
        return &images_.emplace(index, decode_image(file, where, 1)).first->second;
    }

    void add_colours_of_texture(const json& primitive, std::size_t count) {
        std::string places;
        const ImageU8* const image = texture_of(primitive, places);
        if (!image) return;
        const auto place = attribute(primitive, places.c_str(), 2);
        if (!place || place->count != count) return;
        const auto pixel = [](double at, int size) {  // pages repeat beyond 0 and 1
            const double share = std::isfinite(at) ? at - std::floor(at) : 0.0;
            return std::min(static_cast<int>(share * size), size - 1);
        };
        for (std::size_t i = 0; i < count; ++i) {
            const int x = pixel(place->value(i, 0), image->width),
                      y = pixel(place->value(i, 1), image->height);
            glm::u8vec3 colour;
            for (int c = 0; c < 3; ++c) colour[c] = image->at(x, y, image->channels < 3 ? 0 : c);
            mesh_.colour.push_back(colour);
        }
    }

    void add_faces(const json& primitive, std::size_t first, std::size_t count, bool mirrored) {
        std::optional<gltf::Accessor> indices;
        if (primitive.contains("indices")) {
            indices =
                gltf::find_accessor(document_, gltf::whole_number(primitive, "indices"), "indices");
            if (indices->type == gltf::kFloat || indices->components != 1)
                throw wrong("its indices are no whole numbers");
        }
        const std::size_t corners = indices ? indices->count : count;
        if (corners % 3 != 0)
            throw wrong(fmt::format("{} corners are no whole triangles", corners));
        check_expansion(document_.bytes, 40 * mesh_.vertices() + 12 * mesh_.faces() + 4 * corners,
                        document_.where);
        for (std::size_t i = 0; i < corners; i += 3) {
            std::uint32_t corner[3];
            for (std::size_t c = 0; c < 3; ++c) {
                const double local =
                    indices ? indices->value(i + c, 0) : static_cast<double>(i + c);
                if (!(local >= 0) || local >= static_cast<double>(count))
                    throw wrong(
                        fmt::format("triangle {} names vertex {} of {}", i / 3, local, count));
                corner[c] = static_cast<std::uint32_t>(first + static_cast<std::size_t>(local));
            }
            if (mirrored) std::swap(corner[1], corner[2]);
            mesh_.add_face(corner, fmt::format("triangle {} of primitive {}", i / 3, primitive_));
        }
    }

    const gltf::Document& document_;
    const MeshReadOptions& options_;
    MeshBuilder& mesh_;
    std::map<std::size_t, ImageU8> images_;
    int primitive_ = -1;
    std::size_t lines_ = 0;
};

void read_gltf_mesh(Bytes file, const std::string& where, const fs::path& folder,
                    const MeshReadOptions& options, MeshBuilder& mesh) try {
    SplatSource source;
    source.bytes = file;
    source.where = where;
    source.folder = folder;
    const gltf::Document document = gltf::open_document(source);
    GltfMeshReader(document, options, mesh).read();
} catch (const json::exception& error) {
    throw Error(where, json_reason(error), kCopyAgain);
} catch (const std::out_of_range& error) {
    throw Error(where, std::string("refers to something that does not exist: ") + error.what(),
                kCopyAgain);
}

}  // namespace

TriangleMesh parse_mesh(Bytes file, const std::string& where, const fs::path& folder,
                        std::vector<std::string>* notes, const MeshReadOptions& options) {
    MeshBuilder mesh(where, notes);
    const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
    const fs::path name = where;
    if (looks_like_ply(file)) {
        read_ply_mesh(file, where, mesh);
    } else if (text.starts_with("glTF") || has_extension(name, ".gltf") ||
               has_extension(name, ".glb")) {
        read_gltf_mesh(file, where, folder, options, mesh);
    } else if (has_extension(name, ".obj")) {
        ObjReader(text, where, mesh).read();
    } else {
        throw Error(where, "is no mesh or point cloud that is known here",
                    "Name a file of one of these kinds: " + mesh_endings() + ".");
    }
    return mesh.finish();
}

TriangleMesh read_mesh(const fs::path& path, std::vector<std::string>* notes,
                       const MeshReadOptions& options) {
    return parse_mesh(read_file(path), path.string(), path.parent_path(), notes, options);
}

}  // namespace darb
