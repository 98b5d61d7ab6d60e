// SPDX-License-Identifier: MIT
// Meshes in the viewer without a window: what is drawn of them, alone and among splats; opening,
// making and saving; points that are picked on meshes and splats, and the scale that they give.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <glm/gtc/matrix_transform.hpp>

#include "engine/core/error.h"
#include "engine/mesh/mesh_file.h"
#include "engine/scene/splat_file.h"
#include "tests/support/mesh_shapes.h"
#include "tests/support/viewer_fixture.h"
#include "viewer/mesh_picture.h"
#include "viewer/saved_files.h"
#include "viewer/view_camera.h"

namespace darb::test {
namespace {

constexpr int kWide = 150, kHigh = 110;

Camera looking_along_z(double distance) {
    Camera c;
    c.width = kWide;
    c.height = kHigh;
    c.fx = c.fy = 120;
    c.cx = 71.3;
    c.cy = 58.1;
    c.translation.z = distance;
    return c;
}

void add_faces(const TriangleMesh& more, TriangleMesh& mesh) {
    const auto first = static_cast<std::uint32_t>(mesh.vertex_count());
    mesh.position.insert(mesh.position.end(), more.position.begin(), more.position.end());
    for (auto face : more.face) {
        for (std::uint32_t& corner : face) corner += first;
        mesh.face.push_back(face);
    }
}

struct DrawnMesh {
    std::vector<float> depth;
    std::vector<std::uint32_t> pixels;
};

DrawnMesh drawn(const TriangleMesh& mesh, const Camera& camera, const DisplaySettings& display) {
    MeshPicture picture(shared_device(), mesh);
    picture.reserve(camera.width, camera.height);
    Commands commands(shared_device());
    commands.begin();
    picture.record(commands, camera, display);
    commands.submit_and_wait();
    const auto count = std::size_t(camera.width) * std::size_t(camera.height);
    return {picture.depth().download<float>(count),
            picture.pixels().download<std::uint32_t>(count)};
}

// A torus of small faces before a wall of two large ones, and a floor that reaches behind the eye.
TEST(MeshPicture, Has_the_depths_that_rays_find_in_double) {
    TriangleMesh mesh = torus_mesh(1, 0.35, 40, 24);
    add_faces(box_mesh({-3, -2, 2}, {3, 2, 2.5}), mesh);
    Camera camera = looking_along_z(4);
    camera.rotation = glm::dmat3(glm::rotate(glm::dmat4(1.0), 0.3, glm::dvec3(0.3, 1, 0.2)));
    TriangleMesh floor;
    for (const glm::dvec3& p : {glm::dvec3(-3, 0.3, -5), {3, 0.3, -5}, {0, 0.3, 12}})
        floor.position.emplace_back(glm::transpose(camera.rotation) * (p - camera.translation));
    floor.face = {{0, 1, 2}};
    add_faces(floor, mesh);
    mesh.origin = {200, -300, 50};
    camera.translation -= camera.rotation * glm::dvec3(200, -300, 50);
    DisplaySettings display;
    display.near_plane = 0.2f;
    const DrawnMesh image = drawn(mesh, camera, display);
    int hits = 0, misses = 0, large = 0;
    for (int y = 0; y < kHigh; ++y)
        for (int x = 0; x < kWide; ++x) {
            const auto hit = point_on_mesh(mesh, camera, 0.2, {x + 0.5, y + 0.5});
            const double wanted = hit ? (camera.rotation * *hit + camera.translation).z : INFINITY;
            const double got = double{image.depth[std::size_t(y * kWide + x)]};
            const bool same =
                std::isinf(wanted) ? std::isinf(got) : std::abs(got - wanted) < 1e-4 * wanted;
            ++(same ? hits : misses);
            large += !std::isinf(wanted) && wanted < 1;
        }
    // On a silhouette rounding may decide.
    EXPECT_LE(misses, 3) << "of " << hits + misses;
    EXPECT_GT(large, 100) << "the floor reaches past the near plane";
}

TEST(MeshPicture, Shows_colours_shape_or_edges) {
    TriangleMesh wall = box_mesh({-1, -1, 0}, {1, 1, 0.1f});
    for (const glm::vec3& p : wall.position)
        wall.colour.emplace_back(p.x > 0 ? 255 : 0, p.y > 0 ? 255 : 0, 51);
    DisplaySettings display;
    display.background = {0.2f, 0, 0};
    const Camera camera = looking_along_z(3);
    const auto at = [&](const DrawnMesh& image, double x, double y) {
        const auto px = pixel_of(camera, {x, y, 0});
        return image.pixels[std::size_t(px->y) * kWide + std::size_t(px->x)];
    };
    const DrawnMesh coloured = drawn(wall, camera, display);
    const std::uint32_t middle = at(coloured, 0.5, -0.25);  // B8G8R8A8: blue lowest
    EXPECT_NEAR(double(middle >> 16 & 255), 0.75 * 255, 4);
    EXPECT_NEAR(double(middle >> 8 & 255), 0.375 * 255, 4);
    EXPECT_EQ(middle & 255, 51u);
    EXPECT_EQ(at(coloured, 1.3, 0) >> 16 & 255, 51u) << "the background";
    display.mesh_look = MeshLook::shape;
    const DrawnMesh grey = drawn(wall, camera, display);
    const std::uint32_t shade = at(grey, 0.5, -0.25);
    EXPECT_NEAR(double(shade >> 16 & 255), double(shade >> 8 & 255), 8);
    EXPECT_NE(shade, middle);
    display.mesh_look = MeshLook::edges;
    const DrawnMesh lines = drawn(wall, camera, display);
    EXPECT_EQ(at(lines, 0.5, 0.7), at(grey, 0.5, 0.7)) << "inside a face";
    int darker = 0;
    for (std::size_t i = 0; i < lines.pixels.size(); ++i)
        darker += lines.pixels[i] != grey.pixels[i];
    EXPECT_GT(darker, 100);
    TriangleMesh bare = wall;
    bare.colour.clear();
    display.mesh_look = MeshLook::colours;
    EXPECT_EQ(at(drawn(bare, camera, display), 0.5, -0.25), shade) << "without colours: its shape";
}

TEST(MeshPicture, Without_faces_is_refused) {
    TriangleMesh points = box_mesh({0, 0, 0}, {1, 1, 1});
    points.face.clear();
    EXPECT_THROW(MeshPicture(shared_device(), points), Error);
}

class MeshView : public ViewerTest {
  protected:
    Session& session() { return viewer_->session(); }
    void frame(const Input& input = {}) { viewer_->frame(input, kWidth, kHeight, true); }
    void ask(const Request& request) {
        session().ask(request);
        frame();
        finish();
    }
    void finish() {
        while (viewer_->loading() || session().progress.mesh >= 0) frame();
        frame();
    }
    void drop(const fs::path& file) {
        Input input;
        input.dropped = {file};
        frame(input);
        finish();
    }
    void click(const glm::dvec2& px) {
        Input input;
        input.left = true;
        input.trail = {px};
        input.x = px.x;
        input.y = px.y;
        frame(input);
        input.left = false;
        input.trail.clear();
        frame(input);
    }
    Camera camera() {
        return camera_in_window(session().photos, session().navigation,
                                free_area(session(), kWidth, kHeight));
    }
    // Splats over the whole view at z = -1 (red, half opaque) and z = 1 (blue, opaque).
    void load_layers() {
        SplatModel m;
        m.resize(2);
        for (std::size_t i = 0; i < 2; ++i) {
            m.position[3 * i + 2] = i == 0 ? -1.0f : 1.0f;
            m.rotation[4 * i] = 1;
            m.log_scale[3 * i] = m.log_scale[3 * i + 1] = 1.5f;
            m.log_scale[3 * i + 2] = -4;
            m.opacity_logit[i] = i == 0 ? 0.0f : 6.0f;
            for (std::size_t c = 0; c < 3; ++c) m.sh_dc[3 * i + c] = -1.7f;
            m.sh_dc[3 * i + (i == 0 ? 0 : 2)] = 1.7f;
        }
        write_ply(file_, m);
        options_.views.clear();
        options_.up = "-y";
        make_viewer(options_);
        load(file_);
        frame();  // which frames the scene
        session().navigation.eye = {0, 0, -4};
        session().navigation.axes = glm::dmat3(1.0);
        session().navigation.distance = 4;
    }
    // Green, over the left half of the view.
    fs::path wall(float z) {
        TriangleMesh mesh = box_mesh({-9, -9, z}, {0, 9, z + 0.01f});
        mesh.colour.assign(8, {0, 255, 0});
        write_mesh(folder_ / "wall.ply", mesh);
        return folder_ / "wall.ply";
    }
    static glm::ivec3 at(const ImageU8& image, int x) {
        const int y = kHeight / 2;
        return {image.at(x, y, 0), image.at(x, y, 1), image.at(x, y, 2)};
    }
};

TEST_F(MeshView, Among_splats_it_hides_those_behind_and_is_seen_through_those_before) {
    load_layers();
    const ImageU8 splats = shot();
    const glm::ivec3 left = at(splats, 20), right = at(splats, 76);
    EXPECT_GT(left.r, 90);
    EXPECT_GT(left.b, 90) << "blue shows through red";
    drop(wall(0));
    EXPECT_EQ(session().display.mesh, MeshShow::both);
    const ImageU8 both = shot();
    EXPECT_NEAR(at(both, 20).r, left.r, 5) << "red is before the wall, and blue has a little red";
    EXPECT_GT(at(both, 20).g, 90) << "the wall shows through it";
    EXPECT_LT(at(both, 20).b, 10) << "blue is behind it";
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(at(both, 76)[c], right[c], 1) << "beside the wall";
    session().display.mesh_nearer = 0.5f;
    EXPECT_EQ(at(shot(), 20), glm::ivec3(0, 255, 0)) << "brought before the red one";
    session().display.mesh = MeshShow::alone;
    const ImageU8 alone = shot();
    EXPECT_EQ(at(alone, 20), glm::ivec3(0, 255, 0));
    EXPECT_EQ(at(alone, 76), glm::ivec3(0));
    session().display.mesh = MeshShow::beside;
    frame();
    ASSERT_EQ(session().panes.lines.size(), 1u);
    const ImageU8 beside = shot();
    EXPECT_EQ(at(beside, 20), left) << "splats left of the line";
    session().panes.lines = {0.1f};
    EXPECT_EQ(at(shot(), 20), glm::ivec3(0, 255, 0)) << "the mesh right of it";
    ask(request::CloseMesh{});
    EXPECT_EQ(largest_difference(shot(), splats), 0);
}

TEST_F(MeshView, In_motion_it_is_shown_as_well) {
    load_layers();
    drop(wall(0));
    shot();
    session().navigation.orbit(0.05, 0);
    for (int i = 0; i < 3; ++i) {
        const ImageU8 moving = shot(false);
        EXPECT_GT(at(moving, 20).g, 90);
        EXPECT_LT(at(moving, 20).b, 10);
        session().navigation.orbit(0.01, 0);
    }
}

TEST_F(MeshView, A_file_of_a_mesh_opens_alone) {
    TriangleMesh mesh = torus_mesh(1, 0.4, 24, 12);
    write_mesh(folder_ / "torus.glb", mesh);
    load(folder_ / "torus.glb");
    EXPECT_EQ(session().display.mesh, MeshShow::alone);
    ASSERT_TRUE(session().mesh);
    frame();
    frame();
    const ImageU8 shown = shot();
    int lit = 0;
    for (std::size_t i = 0; i < shown.data.size(); i += 3) lit += shown.data[i] > 20;
    EXPECT_GT(lit, kWidth * kHeight / 6) << "it is framed and shaded";
    ask(request::MakeMesh{});
    EXPECT_NE(session().error.find("only points"), std::string::npos) << session().error;
}

TEST_F(MeshView, What_is_no_mesh_is_refused_and_leaves_the_one_that_is_shown) {
    load_layers();
    drop(wall(0));
    const ImageU8 before = shot();
    std::ofstream(folder_ / "note.glb") << "a text";
    TriangleMesh points = box_mesh({0, 0, 0}, {1, 1, 1});
    points.face.clear();
    write_mesh(folder_ / "points.obj", points);
    for (const auto& [name, why] :
         {std::pair("note.glb", "holds no mesh of triangles"),
          std::pair("points.obj", "has no faces"), std::pair("none.glb", "none.glb")}) {
        session().error.clear();
        ask(request::OpenMesh{folder_ / name});
        EXPECT_NE(session().error.find(why), std::string::npos) << session().error;
    }
    session().error.clear();
    frame();
    EXPECT_EQ(largest_difference(shot(), before), 0);
}

TEST_F(MeshView, Named_with_the_scene_it_is_there_when_loading_ends) {
    load_layers();
    options_.mesh = wall(0);
    make_viewer(options_);
    session().display.mesh = MeshShow::alone;
    load(file_);
    ASSERT_TRUE(session().mesh);
    EXPECT_EQ(session().display.mesh, MeshShow::alone);
    load(file_);
    EXPECT_FALSE(session().mesh) << "it was of the first scene";
    EXPECT_EQ(session().display.mesh, MeshShow::none);
}

TEST_F(MeshView, Is_made_of_the_scene_and_saved_and_can_be_cancelled) {
    load_layers();
    ask(request::SaveMesh{});
    EXPECT_NE(session().error.find("none to save"), std::string::npos) << session().error;
    session().error.clear();
    session().mesh_wish.voxel = 0.3f;
    for (const double x : {-0.4, -0.2, 0.2, 0.4}) {
        View view;
        view.camera = session().navigation.camera(kWidth, kHeight);
        view.camera.translation.x = x;
        session().photos.views.push_back(view);
    }
    session().ask(request::MakeMesh{});
    frame();
    EXPECT_GE(session().progress.mesh, 0);
    Input escape;
    escape.pressed = {Key::escape};
    frame(escape);
    frame();
    EXPECT_LT(session().progress.mesh, 0);
    EXPECT_FALSE(session().mesh);
    ask(request::MakeMesh{});
    EXPECT_TRUE(session().error.empty()) << session().error;
    ASSERT_TRUE(session().mesh);
    EXPECT_TRUE(session().mesh->file.empty());
    ask(request::Quit{});
    EXPECT_TRUE(session().leaving) << "it is in no file";
    ask(request::Stay{});
    const std::string kept = recover_unsaved(session());
    EXPECT_NE(kept.find("scene_mesh_recovered.glb"), std::string::npos) << kept;
    EXPECT_GT(read_mesh(folder_ / "scene_mesh_recovered.glb").face_count(), 0u);
    session().mesh_file = folder_ / "made.ply";
    ask(request::SaveMesh{});
    EXPECT_EQ(recover_unsaved(session()), "");
    EXPECT_EQ(read_mesh(folder_ / "made.ply").face_count(), session().mesh->mesh.face_count());
    session().mesh_file = folder_ / "scene.ply";  // not this program's
    ask(request::SaveMesh{});
    EXPECT_FALSE(session().error.empty());
    EXPECT_EQ(load_splats(folder_ / "scene.ply").size(), 2u);
}

TEST_F(MeshView, Clicks_measure_on_the_splats_and_give_the_scale) {
    load_layers();
    session().panels = true;
    session().gui_scale = 0.01f;  // leaves the whole window to the picture
    session().navigation.centre_x = 0.5;
    Input tool;
    tool.pressed = {Key::tool_measure};
    frame(tool);
    click({30, 40});
    click({60, 20});
    const std::vector<glm::dvec3> points = session().edit.facts().measured.points;
    ASSERT_EQ(points.size(), 2u) << session().error << session().note;
    const Camera c = camera();
    for (std::size_t i = 0; i < 2; ++i) {
        // Half opaque red alone leaves half of the light: the surface is blue's.
        // It begins a little before their middle.
        EXPECT_NEAR(points[i].z, 1, 0.1) << i;
        const glm::dvec2 px = *pixel_of(c, points[i]);
        EXPECT_NEAR(px.x, (i == 0 ? 30 : 60) + 0.5, 1e-6);
        EXPECT_NEAR(px.y, (i == 0 ? 40 : 20) + 0.5, 1e-6);
    }
    set_known_length(-1, 3, session());
    EXPECT_NEAR(session().edit.facts().metres_per_unit, 3 / glm::distance(points[0], points[1]),
                1e-12);
    session().save_file = folder_ / "scaled.ply";
    ask(request::Save{});
    EXPECT_EQ(load_splats(folder_ / "scaled.ply").metres_per_unit,
              session().edit.facts().metres_per_unit);
    Input undo;
    undo.pressed = {Key::undo};
    frame(undo);
    EXPECT_EQ(session().edit.facts().metres_per_unit, 0);
    Input remove;
    remove.pressed = {Key::remove};
    frame(remove);
    EXPECT_EQ(session().edit.facts().measured.points.size(), 1u);
    EXPECT_EQ(session().edit.removed_count(), 0u);
}

TEST_F(MeshView, A_flood_begins_at_the_surface_and_not_at_what_floats_before_it) {
    load_layers();
    session().panels = true;
    session().gui_scale = 0.01f;
    session().navigation.centre_x = 0.5;
    Input tool;
    tool.pressed = {Key::tool_flood};
    frame(tool);
    // Beside red's centre, where less than half of the light stops at red.
    click(*pixel_of(camera(), {0, 0, -1}) + glm::dvec2(5, 0));
    const Edit& edit = session().edit;
    ASSERT_EQ(edit.selected_count(), 1u) << session().error << session().note;
    EXPECT_EQ(edit.selected()[1], 1) << "blue, though red's centre is nearer to the eye";
    const auto& flood = std::get<by::Flood>(std::get<edits::Select>(edit.operations()[0]).what);
    EXPECT_NEAR(flood.at.z, 1, 0.1);
}

TEST_F(MeshView, Clicks_measure_on_the_mesh_where_it_is_shown) {
    load_layers();
    drop(wall(0));
    session().panels = true;
    session().gui_scale = 0.01f;
    Input tool;
    tool.pressed = {Key::tool_measure};
    frame(tool);
    click({20, 32});
    click({80, 32});
    std::vector<glm::dvec3> points = session().edit.facts().measured.points;
    ASSERT_EQ(points.size(), 2u);
    EXPECT_NEAR(points[0].z, 0, 1e-6);
    EXPECT_NEAR(points[1].z, 1, 0.1) << "beside the mesh, on the splats";
    session().display.mesh = MeshShow::alone;
    click({90, 20});
    EXPECT_EQ(session().edit.facts().measured.points.size(), 2u);
    EXPECT_NE(session().note.find("no surface"), std::string::npos);
    // A drag beside the points orbits, and one of a point moves it.
    const glm::dvec3 eye = session().navigation.eye;
    Input drag;
    drag.left = true;
    drag.trail = {{50, 10}};
    drag.x = 50;
    drag.y = 10;
    frame(drag);
    drag.trail = {{60, 12}};
    drag.x = 60;
    drag.y = 12;
    drag.dx = 10;
    frame(drag);
    drag = {};
    drag.x = 60;
    drag.y = 12;
    frame(drag);
    EXPECT_NE(session().navigation.eye, eye);
    EXPECT_EQ(session().edit.facts().measured.points.size(), 2u);
}

}  // namespace
}  // namespace darb::test
