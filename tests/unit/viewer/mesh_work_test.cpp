// SPDX-License-Identifier: MIT
// Which files hold a mesh and how they open; where a ray meets one; the thread that makes one.
#include "viewer/mesh_work.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <thread>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/mesh/mesh_file.h"
#include "engine/scene/splat_file.h"
#include "tests/support/mesh_shapes.h"
#include "viewer/scene.h"

namespace darb {
namespace {

namespace fs = std::filesystem;

class MeshFiles : public ::testing::Test {
  protected:
    void SetUp() override { fs::create_directories(folder_); }
    void TearDown() override { fs::remove_all(folder_); }
    fs::path write(const char* name, const TriangleMesh& mesh) {
        write_mesh(folder_ / name, mesh);
        return folder_ / name;
    }
    fs::path text(const char* name, const std::string& content) {
        write_file_atomic(folder_ / name, content);
        return folder_ / name;
    }
    static std::string error_of(const std::function<void()>& step) {
        try {
            step();
        } catch (const Error& e) {
            return e.what();
        }
        return "none";
    }
    fs::path folder_ = fs::temp_directory_path() / ("darb_mesh_work_" + std::to_string(::getpid()));
};

TEST_F(MeshFiles, Every_format_opens_as_a_mesh_with_its_vertices_as_points) {
    const TriangleMesh box = test::box_mesh({-1, -2, -3}, {1, 2, 3});
    for (const char* name : {"box.ply", "box.obj", "box.glb", "box.gltf"}) {
        const fs::path file = write(name, box);
        EXPECT_TRUE(is_mesh_file(file)) << name;
        const Scene scene = load_scene_file(file);
        ASSERT_TRUE(scene.mesh) << name;
        EXPECT_EQ(scene.mesh->mesh.face_count(), 12u) << name;
        EXPECT_TRUE(scene.is_points);
        EXPECT_EQ(scene.model.size(), 8u) << name;
        EXPECT_NEAR(scene.bounds.radius, std::sqrt(14.0), 0.2) << name;
        ASSERT_FALSE(scene.notes.empty());
        EXPECT_NE(scene.notes.back().find("no colours"), std::string::npos) << scene.notes.back();
    }
}

TEST_F(MeshFiles, A_texture_within_the_file_colours_the_vertices) {
    TriangleMesh square;
    square.position = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    square.face = {{0, 1, 2}, {0, 2, 3}};
    MeshTexture texture;
    const glm::vec2 at[] = {{0.1f, 0.1f}, {0.9f, 0.1f}, {0.9f, 0.9f}, {0.1f, 0.9f}};
    texture.uv = {{at[0], at[1], at[2]}, {at[0], at[2], at[3]}};
    texture.page = {0, 0};
    texture.image = {ImageU8(2, 2, 3)};
    const glm::u8vec3 colours[] = {{255, 0, 0}, {0, 255, 0}, {0, 0, 255}, {9, 90, 200}};
    const int x[] = {0, 1, 1, 0}, y[] = {0, 0, 1, 1};
    for (int i = 0; i < 4; ++i)
        for (int c = 0; c < 3; ++c) texture.image[0].at(x[i], y[i], c) = colours[i][c];
    write_mesh(folder_ / "square.glb", square, &texture);
    const ShownMesh shown = read_shown_mesh(folder_ / "square.glb");
    ASSERT_EQ(shown.mesh.colour.size(), shown.mesh.vertex_count());
    EXPECT_TRUE(shown.notes.empty());
    for (std::size_t v = 0; v < shown.mesh.vertex_count(); ++v)
        for (int i = 0; i < 4; ++i)
            if (glm::distance(shown.mesh.position[v], square.position[std::size_t(i)]) < 1e-6f) {
                EXPECT_EQ(shown.mesh.colour[v], colours[i]) << i;
            }
    EXPECT_TRUE(read_mesh(folder_ / "square.glb").colour.empty()) << "where nobody asks for them";
    write_mesh(folder_ / "square.gltf", square, &texture);
    EXPECT_EQ(read_shown_mesh(folder_ / "square.gltf").notes.size(), 1u) << "a file beside it";
}

TEST_F(MeshFiles, A_broken_texture_is_an_error_that_names_it) {
    const TriangleMesh box = test::box_mesh({0, 0, 0}, {1, 1, 1});
    MeshTexture texture;
    texture.uv.resize(box.face_count());
    texture.page.resize(box.face_count());
    texture.image = {ImageU8(4, 4, 3)};
    std::vector<std::byte> file = encode_mesh(box, "box.glb", &texture).file;
    const std::string text(reinterpret_cast<const char*>(file.data()), file.size());
    file[text.find("PNG")] = std::byte{0};
    const std::string said =
        error_of([&] { parse_mesh(file, "box.glb", {}, nullptr, {.colours_of_textures = true}); });
    EXPECT_NE(said.find("box.glb, image 0"), std::string::npos) << said;
    EXPECT_EQ(parse_mesh(file, "box.glb").face_count(), 12u) << "where nobody asks for it";
}

TEST_F(MeshFiles, What_is_no_mesh_says_so) {
    SplatModel splats;
    splats.resize(3);
    for (std::size_t i = 0; i < 3; ++i) splats.rotation[4 * i] = 1;
    save_splats(folder_ / "splats.ply", SplatFormat::ply, splats);
    save_splats(folder_ / "splats.glb", SplatFormat::gltf, splats);
    TriangleMesh points = test::box_mesh({0, 0, 0}, {1, 1, 1});
    points.face.clear();
    const fs::path cloud = write("cloud.ply", points), note = text("note.txt", "a text\n");
    for (const fs::path& file : {folder_ / "splats.ply", folder_ / "splats.glb", cloud, note,
                                 text("empty.ply", ""), folder_ / "none.glb", folder_}) {
        EXPECT_FALSE(is_mesh_file(file)) << file;
        const std::string said = error_of([&] { check_mesh_file(file); });
        EXPECT_NE(said.find(file.filename().string()), std::string::npos) << said;
    }
    EXPECT_NE(error_of([&] { check_mesh_file(note); }).find("no mesh of triangles"),
              std::string::npos);
    EXPECT_NE(error_of([&] { read_shown_mesh(cloud); }).find("has no faces"), std::string::npos);
    const fs::path bare = write("bare.obj", points);
    EXPECT_NE(error_of([&] { read_shown_mesh(bare); }).find("has no faces"), std::string::npos);
    EXPECT_FALSE(load_scene_file(bare).mesh) << "but its points are a scene";
}

TEST(PointOnMesh, Is_the_nearest_beyond_the_near_plane) {
    TriangleMesh box = test::box_mesh({-1, -1, -1}, {1, 1, 1});
    box.origin = {5000, 0, 0};
    Camera camera;
    camera.width = camera.height = 100;
    camera.fx = camera.fy = 100;
    camera.cx = camera.cy = 50;
    camera.translation = {-5000, 0, 4};
    const auto hit = point_on_mesh(box, camera, 0.1, {60, 40});
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->x, 5000 + 0.3, 1e-9);
    EXPECT_NEAR(hit->y, -0.3, 1e-9);
    EXPECT_NEAR(hit->z, -1, 1e-9);
    EXPECT_NEAR(point_on_mesh(box, camera, 3.5, {50, 50})->z, 1, 1e-9) << "the far side";
    EXPECT_FALSE(point_on_mesh(box, camera, 6, {50, 50}));
    EXPECT_FALSE(point_on_mesh(box, camera, 0.1, {99, 50}));
}

TEST(MeshJob, Gives_the_mesh_its_error_or_nothing_once_cancelled) {
    MeshJob good(
        [](const MeshProgress& progress) {
            progress("half", 0.5);
            return ShownMesh{test::box_mesh({0, 0, 0}, {1, 1, 1}), {}, {}};
        },
        {});
    good.wait();
    EXPECT_TRUE(good.done());
    EXPECT_EQ(good.stage(), "half");
    EXPECT_EQ(good.share(), 0.5);
    EXPECT_EQ(good.take()->mesh.face_count(), 12u);
    MeshJob bad([](const MeshProgress&) -> ShownMesh { throw Error("a", "b", "c"); }, {});
    bad.wait();
    EXPECT_THROW(bad.take(), Error);
    MeshJob endless(
        [](const MeshProgress& progress) -> ShownMesh {
            for (;;) {
                progress("on and on", 0);
                std::this_thread::yield();
            }
        },
        {});
    endless.cancel();
    endless.wait();
    EXPECT_FALSE(endless.take());
}

}  // namespace
}  // namespace darb
