// SPDX-License-Identifier: MIT
// Files of meshes: what is written is read back, files of other writers are read as they state,
// damaged ones are refused, and assimp reads what is written.
#include "engine/mesh/mesh_file.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <functional>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/rng.h"
#include "engine/data/image_io.h"
#include "engine/scene/gltf.h"
#include "tests/support/mesh_shapes.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;
using FileBytes = std::vector<std::byte>;

const char* const kEndings[] = {".ply", ".obj", ".glb", ".gltf"};

FileBytes bytes_of(std::string_view text) {
    const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
    return {bytes.begin(), bytes.end()};
}

std::string text_of(const FileBytes& bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::string error_of_mesh(const std::function<void()>& action) {
    try {
        action();
    } catch (const Error& error) {
        return error.what();
    }
    return "no error";
}

class MeshFile : public testing::Test {
  protected:
    void SetUp() override { fs::create_directories(folder_); }
    void TearDown() override { fs::remove_all(folder_); }
    const fs::path folder_ = fs::path(testing::TempDir()) / fmt::format("mesh_{}", ::getpid());
};

/// Every array filled, and every sRGB byte met.
TriangleMesh full_mesh() {
    TriangleMesh mesh = sphere_mesh(0.7, 16, 20);
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
        mesh.colour.emplace_back(v % 256, (7 * v) % 256, 255 - v % 256);
    return mesh;
}

MeshTexture texture_of(const TriangleMesh& mesh) {
    MeshTexture texture;
    for (std::uint32_t page = 0; page < 2; ++page) {
        ImageU8& image = texture.image.emplace_back(16, 8, 3);
        for (std::size_t i = 0; i < image.data.size(); ++i)
            image.data[i] = static_cast<std::uint8_t>(40 * page + i % 200);
    }
    for (std::uint32_t f = 0; f < mesh.face_count(); ++f) {
        const float u = static_cast<float>(f % 4) / 4;
        texture.uv.push_back(
            {glm::vec2(u, 0.25f), glm::vec2(u + 0.25f, 0.25f), glm::vec2(u, 1.0f)});
        texture.page.push_back(f % 2);
    }
    return texture;
}

TEST_F(MeshFile, what_is_written_is_read_back) {
    const TriangleMesh mesh = full_mesh();
    for (const char* ending : kEndings) {
        const fs::path path = folder_ / (std::string("whole") + ending);
        write_mesh(path, mesh);
        const TriangleMesh read = read_mesh(path);
        ASSERT_EQ(read.vertex_count(), mesh.vertex_count()) << ending;
        EXPECT_EQ(read.face, mesh.face) << ending;
        EXPECT_EQ(read.colour, mesh.colour) << ending;
        EXPECT_EQ(read.origin, mesh.origin) << ending;
        ASSERT_EQ(read.normal.size(), mesh.normal.size()) << ending;
        for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
            EXPECT_EQ(read.position[v], mesh.position[v]) << ending << ", vertex " << v;
            EXPECT_LT(glm::distance(read.normal[v], mesh.normal[v]), 1e-6f) << ending;
        }
    }
    std::size_t files = 0;
    for (const auto& entry : fs::directory_iterator(folder_)) {
        EXPECT_EQ(entry.path().filename().string().find("tmp"), std::string::npos);
        ++files;
    }
    EXPECT_EQ(files, 5u) << "four meshes, and the .bin of the .gltf";
}

TEST_F(MeshFile, far_from_the_origin_keeps_every_digit) {
    TriangleMesh mesh = torus_mesh(2, 0.5, 12, 8);
    mesh.origin = {412345.25, -5.5e6, 1024.125};
    for (const char* ending : kEndings) {
        const fs::path path = folder_ / (std::string("far") + ending);
        write_mesh(path, mesh);
        const TriangleMesh read = read_mesh(path);
        ASSERT_EQ(read.vertex_count(), mesh.vertex_count()) << ending;
        for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
            for (int c = 0; c < 3; ++c) {
                const auto axis = static_cast<std::size_t>(c);
                // A float of a few metres has 2^-22 at most; a float so far from 0 has 0.5.
                EXPECT_NEAR(read.origin[axis] + double{read.position[v][c]},
                            mesh.origin[axis] + double{mesh.position[v][c]}, 1e-6)
                    << ending << ", vertex " << v;
            }
    }
}

TEST_F(MeshFile, texture_has_its_place_on_every_face) {
    const TriangleMesh mesh = torus_mesh(1, 0.3, 6, 6);
    const MeshTexture texture = texture_of(mesh);
    write_mesh(folder_ / "t.obj", mesh, &texture);
    EXPECT_EQ(read_image(folder_ / "t_1.png").data, texture.image[1].data);
    const std::string obj = read_text_file(folder_ / "t.obj");
    EXPECT_NE(obj.find("mtllib t.mtl\n"), std::string::npos);
    EXPECT_NE(obj.find("usemtl page_1\n"), std::string::npos);
    EXPECT_NE(obj.find("vt 0.25 0.75\n"), std::string::npos) << "v counts from the bottom";
    EXPECT_NE(read_text_file(folder_ / "t.mtl").find("map_Kd t_0.png\n"), std::string::npos);
    EXPECT_EQ(read_mesh(folder_ / "t.obj").face_count(), mesh.face_count());

    write_mesh(folder_ / "t.glb", mesh, &texture, {.jpeg_quality = 90});
    SplatSource source;
    const FileBytes glb = read_file(folder_ / "t.glb");
    source.bytes = glb;
    source.where = "t.glb";
    const gltf::Document document = gltf::open_document(source);
    const auto& primitives = document.json.at("meshes")[0].at("primitives");
    ASSERT_EQ(primitives.size(), 2u);
    std::size_t seen = 0;
    for (std::uint32_t page = 0; page < 2; ++page) {
        const auto& primitive = primitives[page];
        const auto& attributes = primitive.at("attributes");
        const auto uv = gltf::find_accessor(document, attributes.at("TEXCOORD_0"), "uv");
        const auto position = gltf::find_accessor(document, attributes.at("POSITION"), "position");
        const auto indices = gltf::find_accessor(document, primitive.at("indices"), "indices");
        for (std::size_t i = 0; i < indices.count; ++i, ++seen) {
            const std::size_t face = 2 * (i / 3) + page, corner = i % 3;
            const auto at = static_cast<std::size_t>(indices.value(i, 0));
            EXPECT_EQ(float(uv.value(at, 0)), texture.uv[face][corner].x) << face;
            EXPECT_EQ(float(uv.value(at, 1)), texture.uv[face][corner].y) << face;
            EXPECT_EQ(float(position.value(at, 2)), mesh.position[mesh.face[face][corner]].z);
        }
    }
    EXPECT_EQ(seen, 3 * mesh.face_count());
    EXPECT_EQ(document.json.at("images")[1].at("mimeType"), "image/jpeg");
    const std::string error = error_of_mesh([&] { write_mesh(folder_ / "t.ply", mesh, &texture); });
    EXPECT_NE(error.find("no place for a texture"), std::string::npos) << error;
    EXPECT_FALSE(fs::exists(folder_ / "t.ply"));
}

TEST_F(MeshFile, files_of_other_writers_are_read) {
    const TriangleMesh ply = parse_mesh(
        bytes_of("ply\nformat ascii 1.0\nelement vertex 5\nproperty double x\nproperty double y\n"
                 "property double z\nelement face 2\nproperty uchar flags\n"
                 "property list uchar uint vertex_index\nend_header\n"
                 "0 0 0\n1 0 0\n1 1 0\n0 1 0\n0.5 2 0\n7 4 0 1 2 3\n7 3 3 2 4\n"),
        "quads.ply");
    const decltype(ply.face) fan = {{0, 1, 2}, {0, 2, 3}, {3, 2, 4}};
    EXPECT_EQ(ply.face, fan);
    const TriangleMesh obj = parse_mesh(
        bytes_of("# by hand\r\no thing\nv 0 0 0 1\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 2\nvt 0 0\n"
                 "s off\nf 1/1/1 2/1/1 \\\n 3/1/1 -1/1/1\n"),
        "quad.obj");
    const decltype(ply.face) two = {{0, 1, 2}, {0, 2, 3}};
    EXPECT_EQ(obj.face, two);
    ASSERT_EQ(obj.normal.size(), 4u);
    EXPECT_EQ(obj.normal[3], glm::vec3(0, 0, 1));
    // A dart: its reflex corner is the only one from which a fan covers it.
    const TriangleMesh dart =
        parse_mesh(bytes_of("v 0 0 0\nv 2 -1 0\nv 0.5 0 0\nv 2 1 0\nf 2 3 4 1\n"), "dart.obj");
    const decltype(ply.face) from_reflex = {{2, 3, 0}, {2, 0, 1}};
    EXPECT_EQ(dart.face, from_reflex);
    std::vector<std::string> notes;
    const TriangleMesh points = parse_mesh(
        bytes_of("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                 "property float z\nproperty float nx\nproperty float ny\nproperty float nz\n"
                 "end_header\n0 0 0 0 0 1\nnan 0 0 0 0 1\n1 2 3 0 4 0\n"),
        "points.ply", {}, &notes);
    EXPECT_EQ(points.vertex_count(), 2u);
    EXPECT_EQ(points.face_count(), 0u);
    EXPECT_EQ(points.normal[1], glm::vec3(0, 1, 0));
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("1 points that are not finite"), std::string::npos);
}

TEST_F(MeshFile, mistakes_are_named_with_their_place_and_a_remedy) {
    const std::string head =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
    const struct {
        const char* name;
        std::string text, says;
    } cases[] = {
        {"a.ply", head + "0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", "face 0 names vertex 3 of 3"},
        {"b.ply", head + "0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n", "face 0 names vertex -1"},
        {"c.ply", head + "0 0 0\n1 0 0\n0 1 0\n2 0 1\n", "face 0 has 2 corners"},
        {"d.ply", head + "0 0 0\n1 inf 0\n0 1 0\n3 0 1 2\n", "vertex 1 is not finite"},
        {"e.obj", "v 0 0 0\nv 1 0\n", "line 2: a vertex has 2 coordinates"},
        {"f.obj", "v 0 0 0\nf 1 2 3\n", "line 2: names vertex 2 of 1"},
        {"g.obj", "v 0 x 0\n", "line 1: 'x' is not a number"},
        {"h.obj", "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 3 1 0\nv 1 1 0\nv 0 4 0\nf 1 2 3 4 5 6\n",
         "a polygon of 6 corners that is not convex"},
        {"i.obj", "# nothing\n", "has no vertices"},
        {"j.stl", "solid", "is no mesh or point cloud"},
        {"k.gltf", "{\"asset\": 1}", "has no vertices"},
    };
    for (const auto& one : cases) {
        const std::string error = error_of_mesh([&] { parse_mesh(bytes_of(one.text), one.name); });
        EXPECT_EQ(error.find(one.name), 0u) << error;
        EXPECT_NE(error.find(one.says), std::string::npos) << error;
        EXPECT_NE(error.find("\n  "), std::string::npos) << "no remedy in: " << error;
    }
    TriangleMesh mesh = box_mesh(glm::vec3(0), glm::vec3(1));
    EXPECT_NE(error_of_mesh([&] { write_mesh(folder_ / "m.stl", mesh); }).find(".glb"),
              std::string::npos);
    mesh.position.clear();
    mesh.face.clear();
    EXPECT_NE(error_of_mesh([&] { write_mesh(folder_ / "m.ply", mesh); }).find("is empty"),
              std::string::npos);
    EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(MeshFile, cut_and_damaged_files_are_refused_or_read) {
    const TriangleMesh mesh = torus_mesh(1, 0.3, 5, 4);
    for (const char* ending : {".ply", ".glb"}) {
        const std::string where = std::string("test") + ending;
        const FileBytes file = encode_mesh(mesh, where).file;
        for (std::size_t length = 0; length < file.size(); ++length) {
            const std::string error =
                error_of_mesh([&] { parse_mesh(std::span(file).first(length), where); });
            ASSERT_EQ(error.find(where), 0u) << "length " << length << ": " << error;
            ASSERT_NE(error.find("\n  "), std::string::npos) << "no remedy in: " << error;
        }
    }
    Pcg32 rng(5);
    for (const char* ending : kEndings) {
        const std::string where = std::string("test") + ending;
        const EncodedSplats whole = encode_mesh(mesh, where);
        for (int round = 0; round < 300; ++round) {
            FileBytes damaged = whole.file;
            for (std::uint32_t changes = 1 + rng.below(4); changes > 0; --changes)
                damaged[rng.below(static_cast<std::uint32_t>(damaged.size()))] =
                    static_cast<std::byte>(rng.below(256));
            error_of_mesh([&] {
                const TriangleMesh read = parse_mesh(damaged, where);
                for (const auto& face : read.face)
                    for (const std::uint32_t v : face) ASSERT_LT(v, read.vertex_count());
            });
        }
    }
}

TEST_F(MeshFile, glTF_nodes_place_turn_and_mirror) {
    const TriangleMesh mesh = box_mesh(glm::vec3(0), glm::vec3(1, 2, 3));
    EncodedSplats files = encode_mesh(mesh, "box.gltf");
    std::string text = text_of(files.file);
    const std::string node = "\"rotation\":[1,0,0,0]";
    ASSERT_NE(text.find(node), std::string::npos) << text;
    text.replace(text.find(node), node.size(), "\"scale\":[-1,1,1],\"translation\":[10,0,0]");
    write_file_atomic(folder_ / "box.bin", files.beside.at(0).second);
    const TriangleMesh read = parse_mesh(bytes_of(text), "box.gltf", folder_);
    EXPECT_EQ(read.position[7], glm::vec3(9, -2, -3)) << "mirrored, moved, then y and z turned";
    double volume = 0;
    for (const auto& face : read.face)
        volume += glm::dot(read.position[face[0]],
                           glm::cross(read.position[face[1]], read.position[face[2]])) /
                  6;
    EXPECT_NEAR(volume, 6, 1e-4) << "faces still turn outwards";
}

TEST_F(MeshFile, assimp_reads_what_is_written) {
    if (std::system("command -v assimp > /dev/null") != 0)
        GTEST_SKIP() << "assimp is not installed (package assimp-utils)";
    const TriangleMesh mesh = torus_mesh(1, 0.3, 9, 7);
    const MeshTexture texture = texture_of(mesh);
    const auto run = [&](const std::string& command) {
        return std::system(
            fmt::format("cd '{}' && {} > log 2>&1", folder_.string(), command).c_str());
    };
    for (const char* ending : {".ply", ".obj", ".glb", ".gltf"}) {
        const std::string name = std::string("torus") + ending;
        write_mesh(folder_ / name, mesh, std::string(ending) == ".ply" ? nullptr : &texture);
        ASSERT_EQ(run("assimp info " + name), 0) << read_text_file(folder_ / "log");
        const std::string info = read_text_file(folder_ / "log");
        EXPECT_NE(info.find(fmt::format("Faces:              {}", mesh.face_count())),
                  std::string::npos)
            << name << "\n"
            << info;
        // Its own PLY of our file is read back to the same places.
        ASSERT_EQ(run("assimp export " + name + " again.ply"), 0)
            << read_text_file(folder_ / "log");
        const TriangleMesh again = read_mesh(folder_ / "again.ply");
        ASSERT_EQ(again.face_count(), mesh.face_count()) << name;
        double area = 0, wanted = 0;
        const auto area_of = [](const TriangleMesh& m, const auto& f) {
            return glm::length(glm::cross(m.position[f[1]] - m.position[f[0]],
                                          m.position[f[2]] - m.position[f[0]])) /
                   2;
        };
        for (const auto& face : again.face) area += area_of(again, face);
        for (const auto& face : mesh.face) wanted += area_of(mesh, face);
        EXPECT_NEAR(area, wanted, 1e-3) << name;
    }
}

}  // namespace
}  // namespace darb::test
