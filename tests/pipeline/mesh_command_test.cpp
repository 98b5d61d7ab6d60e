// SPDX-License-Identifier: MIT
// darb mesh, as a user runs it: files, reports, errors, the same bits again and within less memory.
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>

#include "engine/core/files.h"
#include "engine/data/image_io.h"
#include "engine/mesh/clean.h"
#include "engine/mesh/collider.h"
#include "engine/mesh/mesh_file.h"
#include "engine/mesh/surface_search.h"
#include "engine/mesh/topology.h"
#include "engine/scene/ply.h"
#include "engine/scene/splat_file.h"
#include "tests/support/run_command.h"

namespace darb::test {
namespace {

/// A ball of flat splats, radius 1.
fs::path ball_file() {
    const fs::path path = scratch() / "ball.ply";
    SplatModel model;
    const int n = 1500;
    model.resize(n);
    for (int i = 0; i < n; ++i) {
        const double y = 1 - (2.0 * i + 1) / n, r = std::sqrt(1 - y * y), a = 2.39996323 * i;
        const double p[3] = {r * std::cos(a), y, r * std::sin(a)};
        for (int c = 0; c < 3; ++c) {
            model.position[3 * i + c] = static_cast<float>(p[c]);
            model.log_scale[3 * i + c] = std::log(c == 2 ? 0.002f : 0.05f);
            model.sh_dc[3 * i + c] = static_cast<float>(p[c]);
        }
        const double length = std::sqrt((1 + p[2]) * 2);  // the turn of z to p
        model.rotation[4 * i] = static_cast<float>((1 + p[2]) / length);
        model.rotation[4 * i + 1] = static_cast<float>(-p[1] / length);
        model.rotation[4 * i + 2] = static_cast<float>(p[0] / length);
        model.opacity_logit[i] = 5;
    }
    write_ply(path, model);
    return path;
}

constexpr int kAround = 14;

/// Where a camera around the ball stands, and its axes: right, down, forward.
struct Pose {
    glm::dvec3 from;
    glm::dmat3 axes;
};
Pose pose_around(int i) {
    const double y = 1 - (2.0 * i + 1) / kAround, r = std::sqrt(1 - y * y), a = 2.39996323 * i;
    const glm::dvec3 from = 3.4 * glm::dvec3(r * std::cos(a), y, r * std::sin(a));
    const glm::dvec3 forward = -glm::normalize(from);
    const glm::dvec3 right = glm::normalize(glm::cross(glm::dvec3(.1, 1, .05), forward));
    return {from, glm::dmat3(right, glm::cross(forward, right), forward)};
}

const std::string& cameras_file() {
    static const std::string path = [] {
        nlohmann::json list = nlohmann::json::array();
        for (int i = 0; i < kAround; ++i) {
            const auto [from, axes] = pose_around(i);
            nlohmann::json rows = nlohmann::json::array();
            for (int k = 0; k < 3; ++k) rows.push_back({axes[0][k], axes[1][k], axes[2][k]});
            list.push_back({{"id", i},
                            {"img_name", fmt::format("view_{:02}", i)},
                            {"width", 96},
                            {"height", 96},
                            {"position", {from.x, from.y, from.z}},
                            {"rotation", rows},
                            {"fx", 110.0},
                            {"fy", 110.0}});
        }
        const std::string file = scratch_file("around.json");
        write_file_atomic(file, list.dump());
        return file;
    }();
    return path;
}

std::string mesh_of(const std::string& output, const std::string& more = "") {
    return fmt::format("mesh '{}' --cameras '{}' -o '{}' {} {}", ball_file().string(),
                       cameras_file(), scratch_file(output),
                       more.find("--voxel") == std::string::npos ? "--voxel 0.1" : "", more);
}

TEST(MeshCommand, Writes_each_format_and_a_report) {
    const Outcome o =
        darb(mesh_of("round.ply", "--fill-holes 2 --json " + scratch_file("mesh.json")));
    ASSERT_EQ(o.code, 0) << o.err;
    const TriangleMesh mesh = read_mesh(scratch_file("round.ply"));
    const nlohmann::json report = read_json(scratch_file("mesh.json"));
    EXPECT_EQ(report["faces"], mesh.face_count());
    EXPECT_EQ(report["parts"], 1);
    EXPECT_EQ(mesh.colour.size(), mesh.vertex_count());
    double most = 0;
    for (const glm::vec3& p : mesh.position) most = std::max(most, std::abs(glm::length(p) - 1.0));
    EXPECT_LT(most, 0.1);
    EXPECT_EQ(2 * mesh.vertex_count(), mesh.face_count() + 4) << "closed, without handles\n"
                                                              << report.dump();
    for (const char* name : {"ball.obj", "ball.glb"}) {
        ASSERT_EQ(darb(mesh_of(name, "--fill-holes 2")).code, 0);
        EXPECT_EQ(read_mesh(scratch_file(name)).face_count(), mesh.face_count());
    }
}

TEST(MeshCommand, Has_the_same_bits_again_and_within_less_memory) {
    ASSERT_EQ(darb(mesh_of("first.ply")).code, 0);
    ASSERT_EQ(darb(mesh_of("again.ply")).code, 0);
    const std::string report = scratch_file("ranges.json");
    const Outcome o = darb(mesh_of("ranges.ply", "--max-memory 2MB --json " + report));
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_GT(read_json(report)["ranges"], 1);
    const auto bytes = read_file(scratch_file("first.ply"));
    EXPECT_EQ(bytes, read_file(scratch_file("again.ply")));
    EXPECT_EQ(bytes, read_file(scratch_file("ranges.ply")));
}

TEST(MeshCommand, Says_lengths_in_metres_once_the_scale_is_known) {
    SplatModel ball = load_splats(ball_file());
    const std::string scaled = scratch_file("scaled.ply"), report = scratch_file("scaled.json");
    const auto mesh = [&] {
        write_ply(scaled, ball);
        return darb(fmt::format("mesh '{}' --cameras '{}' --voxel 0.2 -o '{}' --json {} --force",
                                scaled, cameras_file(), scratch_file("scaled.obj"), report));
    };
    const Outcome plain = mesh();
    ASSERT_EQ(plain.code, 0) << plain.err;
    EXPECT_EQ(plain.out.find(" m)"), std::string::npos) << plain.out;
    EXPECT_FALSE(read_json(report).contains("metres_per_unit"));
    ball.metres_per_unit = 2.5;
    const Outcome o = mesh();
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.out.find("voxel 0.2 (0.5 m)"), std::string::npos) << o.out;
    EXPECT_EQ(read_json(report)["metres_per_unit"], 2.5);
    const Outcome info = darb("info '" + scaled + "'");
    EXPECT_NE(info.out.find("unit         2.5 m"), std::string::npos) << info.out;
}

#ifdef DARB_HAS_VIEWER
TEST(MeshCommand, Is_shown_by_view_and_what_is_no_mesh_is_refused) {
    const std::string scene = ball_file().string(), picture = scratch_file("shown.png");
    ASSERT_EQ(darb(mesh_of("shown.glb")).code, 0);
    const std::string view = fmt::format(
        "view '{}' --size 64x48 --no-panels --force --screenshot "
        "'{}' --mesh ",
        scene, picture);
    const Outcome plain = darb(view + scratch_file("shown.glb") + " --mesh-show alone");
    ASSERT_EQ(plain.code, 0) << plain.err;
    const ImageU8 coloured = read_image(picture);
    ASSERT_EQ(darb(view + scratch_file("shown.glb") + " --mesh-show alone --mesh-as shape").code,
              0);
    EXPECT_NE(read_image(picture).data, coloured.data);
    write_file_atomic(scratch_file("note.txt"), "a text");
    for (const std::string& other : {scene, scratch_file("note.txt"), scratch_file("none.glb")}) {
        const Outcome o = darb(view + other);
        EXPECT_EQ(o.code, 2) << o.err;
        EXPECT_NE(o.err.find(fs::path(other).filename().string()), std::string::npos) << o.err;
    }
}
#endif

// Rings rise again along a ray, so the default is another reading there.
TEST(MeshCommand, Reads_kernels_with_rings_by_their_planes) {
    SplatModel ball = load_splats(ball_file());
    ball.kernel = KERNEL_SINC_2_PULSES;
    const fs::path ringed = scratch() / "ringed.ply";
    write_ply(ringed, ball);
    const std::string report = scratch_file("rings.json");
    const std::string mesh = fmt::format("mesh '{}' --cameras '{}' --voxel 0.1 -o '{}' ",
                                         ringed.string(), cameras_file(), scratch_file("r.obj"));
    const Outcome o = darb(mesh + "--json " + report);
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(read_json(report)["depth"], "plane");
    EXPECT_EQ(darb(mesh + "--depth front").code, 2);
}

TEST(MeshCommand, Takes_the_opacity_of_the_space) {
    const std::string report = scratch_file("opacity.json");
    const Outcome o = darb(mesh_of("opacity.ply", "--method opacity --json " + report));
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_EQ(read_json(report)["method"], "opacity");
    double most = 0;
    for (const glm::vec3& p : read_mesh(scratch_file("opacity.ply")).position)
        most = std::max(most, std::abs(glm::length(p) - 1.0));
    EXPECT_LT(most, 0.1);
    ASSERT_EQ(darb(mesh_of("parts.ply", "--method opacity --max-memory 3MB --json " + report)).code,
              0);
    EXPECT_GT(read_json(report)["ranges"], 1);
    EXPECT_EQ(read_file(scratch_file("opacity.ply")), read_file(scratch_file("parts.ply")));
    const Outcome mean = darb(mesh_of("mean.ply", "--method opacity --depth expected"));
    EXPECT_EQ(mean.code, 2);
    EXPECT_NE(mean.err.find("--depth front"), std::string::npos) << mean.err;
}

TEST(MeshCommand, Compares_with_a_reference) {
    const std::string truth = scratch_file("shape.json"), report = scratch_file("compared.json");
    write_file_atomic(truth, R"({"shapes": [{"shape": "sphere", "size": [1, 0, 0],
        "position": [0, 0, 0], "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}]})");
    const Outcome o =
        darb(mesh_of("compared.ply", fmt::format("--reference {} --json {}", truth, report)));
    ASSERT_EQ(o.code, 0) << o.err;
    const nlohmann::json found = read_json(report)["comparison"];
    EXPECT_LT(found["accuracy"]["median"], 0.03);
    EXPECT_GT(found["f_scores"][0]["precision"], 0.95);
    const Outcome own = darb(mesh_of(
        "own.ply", fmt::format("--reference {} --json {}", scratch_file("compared.ply"), report)));
    ASSERT_EQ(own.code, 0) << own.err;
    EXPECT_LT(read_json(report)["comparison"]["chamfer"], 1e-5);
}

TEST(MeshCommand, Brings_a_reference_to_the_mesh) {
    ASSERT_EQ(darb(mesh_of("aligned.ply", "--texture none")).code, 0);
    TriangleMesh mesh = read_mesh(scratch_file("aligned.ply")), moved = mesh;
    for (glm::vec3& p : moved.position) p = 1.5f * p + glm::vec3(0.2f, 0, -0.1f);
    const std::string reference = scratch_file("moved.obj"), report = scratch_file("aligned.json");
    write_mesh(reference, moved);
    const Outcome o = darb(mesh_of("aligned.ply", fmt::format("--reference {} --align similarity "
                                                              "--texture none --json {}",
                                                              reference, report)));
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.out.find("aligned: the reference was turned by"), std::string::npos) << o.out;
    EXPECT_NEAR(read_json(report)["alignment"]["scale"], 1 / 1.5, 0.01);
    EXPECT_LT(read_json(report)["comparison"]["chamfer"], 0.01);
}

// Pages.

/// The colour of the photo that camera i took.
glm::u8vec3 photo_colour(int i) {
    return glm::u8vec3(20 + 15 * i, 250 - 15 * i, i % 2 ? 200 : 40);
}

/// A data set of the cameras around the ball, each of whose photos has one colour.
const std::string& data_set() {
    static const std::string folder = [] {
        const fs::path root = scratch() / "photos";
        nlohmann::json file{{"w", 96},
                            {"h", 96},
                            {"fl_x", 110.0},
                            {"fl_y", 110.0},
                            {"cx", 48.0},
                            {"cy", 48.0},
                            {"frames", nlohmann::json::array()}};
        for (int i = 0; i < kAround; ++i) {
            ImageU8 photo(96, 96, 3);
            for (std::size_t p = 0; p < photo.data.size(); ++p)
                photo.data[p] = photo_colour(i)[int(p % 3)];
            const std::string name = fmt::format("images/view_{:02}.png", i);
            write_png(root / name, photo);
            const auto [from, axes] = pose_around(i);
            nlohmann::json rows = nlohmann::json::array();
            for (int k = 0; k < 3; ++k)
                rows.push_back({axes[0][k], -axes[1][k], -axes[2][k], from[k]});
            rows.push_back({0.0, 0.0, 0.0, 1.0});
            file["frames"].push_back({{"file_path", name}, {"transform_matrix", rows}});
        }
        write_file_atomic(root / "transforms.json", file.dump());
        return root.string();
    }();
    return folder;
}

/// How many texels of the pages have each colour.
std::map<std::array<int, 3>, std::size_t> colours_of(const std::vector<fs::path>& pages) {
    std::map<std::array<int, 3>, std::size_t> colours;
    for (const fs::path& page : pages) {
        const ImageU8 image = read_image(page);
        for (std::size_t p = 0; p < image.data.size(); p += std::size_t(image.channels))
            ++colours[{image.data[p], image.data[p + 1], image.data[p + 2]}];
    }
    return colours;
}

TEST(MeshCommand, Paints_pages_with_photos) {
    const std::string report = scratch_file("painted.json");
    const std::string command = fmt::format(
        "mesh '{}' --cameras '{}' -o '{}' --voxel 0.1 --texel 0.02 --texture photos --seams keep "
        "--json {}",
        ball_file().string(), data_set(), scratch_file("painted.obj"), report);
    const Outcome o = darb(command);
    ASSERT_EQ(o.code, 0) << o.err;
    const std::string materials = read_text_file(scratch_file("painted.mtl"));
    EXPECT_NE(materials.find("map_Kd painted_0.png"), std::string::npos) << materials;
    EXPECT_NE(read_text_file(scratch_file("painted.obj")).find("mtllib painted.mtl"),
              std::string::npos);
    const auto found = colours_of({scratch_file("painted_0.png")});
    std::size_t photos = 0, others = 0, used = 0;
    std::set<std::array<int, 3>> known;
    for (int i = 0; i < kAround; ++i) {
        const glm::u8vec3 c = photo_colour(i);
        known.insert({c.x, c.y, c.z});
    }
    for (const auto& [colour, texels] : found) {
        if (colour == std::array{0, 0, 0}) continue;  // between the charts
        (known.count(colour) ? photos : others) += texels;
        used += known.count(colour);
    }
    EXPECT_GE(used, 8u) << "of " << kAround << " photos";
    EXPECT_LT(double(others), 0.1 * double(photos)) << "gutters where two photos meet";
    EXPECT_EQ(read_json(report)["texture"]["pages"], 1);
    EXPECT_LT(double(read_json(report)["texture"]["unseen_faces"]),
              0.02 * double(read_json(report)["faces"]));
}

TEST(MeshCommand, Levels_the_seams_between_photos) {
    const std::string report = scratch_file("levelled.json");
    const auto painted = [&](const std::string& more) {
        return darb(fmt::format(
            "mesh '{}' --cameras '{}' -o '{}' --voxel 0.1 --texel 0.02 --json {} {}",
            ball_file().string(), data_set(), scratch_file("levelled.obj"), report, more));
    };
    const Outcome o = painted("--texture photos");
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_NE(o.out.find("seams: photos differ by"), std::string::npos) << o.out;
    const auto levels = read_json(report)["texture"]["seam_levels"];
    EXPECT_GT(double(levels["before"]), 5) << "photos of one colour each";
    EXPECT_LT(double(levels["after"]), 0.5 * double(levels["before"]));
    const Outcome refused = painted("--texture splats --seams keep");
    EXPECT_EQ(refused.code, 2);
    EXPECT_NE(refused.err.find("--texture photos"), std::string::npos) << refused.err;
}

TEST(MeshCommand, Undoes_the_exposures_that_the_run_learned) {
    const fs::path run = scratch() / "run";
    fs::create_directories(run);
    fs::copy_file(ball_file(), run / "ball.ply", fs::copy_options::overwrite_existing);
    write_file_atomic(run / "run.jsonl", "{\"event\": \"start\"}\n");
    // Photos are half as bright as what the splats learned, and red is lifted.
    nlohmann::json maps = nlohmann::json::object();
    std::set<std::array<int, 3>> undone;
    for (int i = 0; i < kAround; ++i) {
        maps[fmt::format("images/view_{:02}.png", i)] = {
            {0.5, 0.0, 0.0, 0.02}, {0.0, 0.5, 0.0, 0.0}, {0.0, 0.0, 0.5, 0.0}};
        const glm::u8vec3 c = photo_colour(i);
        const auto back = [](double value) { return int(std::min(value, 255.0) + 0.5); };
        undone.insert({back(2 * std::max(c.x - 5.1, 0.0)), back(2.0 * c.y), back(2.0 * c.z)});
    }
    write_file_atomic(run / "exposure.json", maps.dump());
    const std::string command = fmt::format(
        "mesh '{}' --cameras '{}' -o '{}' --voxel 0.1 --texel 0.02 --texture photos --seams keep",
        (run / "ball.ply").string(), data_set(), scratch_file("exposed.obj"));
    const Outcome o = darb(command);
    ASSERT_EQ(o.code, 0) << o.err;
    std::size_t photos = 0, others = 0;
    for (const auto& [colour, texels] : colours_of({scratch_file("exposed_0.png")}))
        if (colour != std::array{0, 0, 0}) (undone.count(colour) ? photos : others) += texels;
    EXPECT_LT(double(others), 0.1 * double(photos)) << "gutters where two photos meet";
    write_file_atomic(run / "exposure.json", R"({"view_00.png": [[1, 0]]})");
    const Outcome damaged = darb(command);
    EXPECT_EQ(damaged.code, 2);
    EXPECT_NE(damaged.err.find("exposure.json"), std::string::npos) << damaged.err;
}

TEST(MeshCommand, Paints_pages_with_the_splats_colours) {
    for (const char* name : {"splats.glb", "splats.gltf"})
        ASSERT_EQ(darb(mesh_of(name, "--texture splats --texel 0.02")).code, 0);
    const auto glb = read_file(scratch_file("splats.glb"));
    const std::string text(reinterpret_cast<const char*>(glb.data()), glb.size());
    EXPECT_NE(text.find("baseColorTexture"), std::string::npos);
    EXPECT_EQ(text.find("COLOR_0"), std::string::npos) << "would be multiplied with the pages";
    // The ball's colour is a smooth function of the place: its pages have many.
    EXPECT_GT(colours_of({scratch_file("splats_0.png")}).size(), 1000u);
    EXPECT_GT(read_mesh(scratch_file("splats.gltf")).face_count(), 1000u);
}

// Colliders.

void add_splat_at(const glm::dvec3& p, int thin, SplatModel& model) {
    const std::size_t i = model.size();
    model.resize(i + 1);
    for (int c = 0; c < 3; ++c) {
        model.position[3 * i + std::size_t(c)] = static_cast<float>(p[c]);
        model.log_scale[3 * i + std::size_t(c)] = std::log(c == thin ? 0.02f : 0.12f);
    }
    model.rotation[4 * i] = 1;
    model.opacity_logit[i] = 4;
}

/// A town of splats: a floor of 10 x 10 at z = 0, and four houses of 2 x 2 x 1.5 around its middle.
fs::path town_file() {
    const fs::path path = scratch() / "town.ply";
    SplatModel model;
    constexpr double kStep = 0.15;
    for (double x = -5; x <= 5; x += kStep)
        for (double y = -5; y <= 5; y += kStep) add_splat_at({x, y, 0}, 2, model);
    for (const double u : {-2.2, 2.2})
        for (const double v : {-2.2, 2.2})
            for (double a = -1; a <= 1; a += kStep) {
                for (double z = 0; z <= 1.5; z += kStep)
                    for (const double side : {-1.0, 1.0}) {
                        add_splat_at({u + side, v + a, z}, 0, model);
                        add_splat_at({u + a, v + side, z}, 1, model);
                    }
                for (double b = -1; b <= 1; b += kStep) add_splat_at({u + a, v + b, 1.5}, 2, model);
            }
    write_ply(path, model);
    return path;
}

/// Cameras that look straight down from over the streets.
std::string flight_file() {
    const std::string file = scratch_file("flight.json");
    nlohmann::json list = nlohmann::json::array();
    for (const auto& [x, y] :
         {std::pair(0.0, -4.0), {0.0, 0.0}, {0.0, 4.0}, {-4.0, 0.0}, {4.0, 0.0}})
        list.push_back({{"id", list.size()},
                        {"img_name", fmt::format("over_{}", list.size())},
                        {"width", 96},
                        {"height", 96},
                        {"position", {x, y, 3.0}},
                        {"rotation", {{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}},
                        {"fx", 80.0},
                        {"fy", 80.0}});
    write_file_atomic(file, list.dump());
    return file;
}

/// Walks a ball over the mesh, from `from` to `to`, and lets it fall at every step. Returns its
/// heights; ends where something is in its way.
std::vector<double> walked(const TriangleMesh& mesh, glm::dvec3 from, const glm::dvec3& to,
                           double radius) {
    const SurfaceSearch search(mesh);
    std::vector<double> heights;
    constexpr double kStep = 0.05;
    const glm::dvec3 step = kStep * glm::normalize(to - from);
    for (double left = glm::distance(from, to); left > 0; left -= kStep) {
        for (double gap; (gap = search.nearest(from).distance - radius) > 1e-3 && from.z > -10;)
            from.z -= gap;
        heights.push_back(from.z);
        from += step + glm::dvec3(0, 0, 0.02);  // what a foot is lifted
        if (search.nearest(from).distance < 0.6 * radius) break;
    }
    return heights;
}

TEST(MeshCommand, A_collider_of_a_town_is_walked_on) {
    if (!can_simplify()) GTEST_SKIP() << "built without meshoptimizer";
    const std::string report = scratch_file("town.json"), out = scratch_file("town_collider.glb");
    const Outcome o = darb(fmt::format(
        "mesh '{}' --cameras '{}' --collider ground --up z --voxel 0.08 -o '{}' --json {}",
        town_file().string(), flight_file(), out, report));
    ASSERT_EQ(o.code, 0) << o.err;
    const nlohmann::json found = read_json(report);
    EXPECT_TRUE(found["closed"]);
    EXPECT_TRUE(found["manifold"]);
    EXPECT_LE(found["faces"], 5000);
    TriangleMesh mesh = read_mesh(out);
    for (const auto& [x, y] : {std::pair(0.0, -4.0), {0.0, 0.0}, {4.0, 0.0}})
        EXPECT_FALSE(is_in_solid(mesh, ColliderKind::ground, {x, y, 3.0}));
    EXPECT_TRUE(is_in_solid(mesh, ColliderKind::ground, {2.2, 2.2, 0.7})) << "a house";
    // Along both streets and around a corner nobody falls, and nobody walks into a house.
    const double radius = 0.2;
    for (const auto& [from, to] : {std::pair(glm::dvec3(0, -4, 1), glm::dvec3(0, 4, 1)),
                                   std::pair(glm::dvec3(-4, 0, 1), glm::dvec3(4, 0, 1)),
                                   std::pair(glm::dvec3(-4, -4, 1), glm::dvec3(4, -4, 1))}) {
        const std::vector<double> heights = walked(mesh, from, to, radius);
        EXPECT_GE(heights.size(), 160u) << "something is in the way";
        for (const double z : heights) EXPECT_NEAR(z, radius, 0.15);
    }
    const std::vector<double> blocked =
        walked(mesh, glm::dvec3(0, 2.2, 0.5), glm::dvec3(4, 2.2, 0.5), radius);
    EXPECT_NEAR(0.05 * double(blocked.size()), 1.2 - radius, 0.2) << "the wall is at x = 1.2";
}

TEST(MeshCommand, A_collider_of_an_object_needs_no_cameras) {
    if (!can_simplify()) GTEST_SKIP() << "built without meshoptimizer";
    const std::string lone = scratch_file("lone.ply");
    fs::copy_file(ball_file(), lone, fs::copy_options::overwrite_existing);
    const Outcome o = darb(fmt::format("mesh {} --collider object --faces 600 --voxel 0.05 -o {}",
                                       lone, scratch_file("object.obj")));
    ASSERT_EQ(o.code, 0) << o.err;
    const TriangleMesh mesh = read_mesh(scratch_file("object.obj"));
    const Topology topology = topology_of(mesh);
    EXPECT_LE(topology.faces, 600u);
    EXPECT_TRUE(topology.is_closed() && topology.is_manifold());
    EXPECT_EQ(topology.parts, 1u) << "splats thinner than a cell leave no holes";
    EXPECT_EQ(topology.genus(), 0);
    for (const glm::vec3& p : mesh.position) EXPECT_NEAR(glm::length(p), 1.03, 0.12);
}

TEST(MeshCommand, Ctrl_C_leaves_no_file) {
    const std::string lone = scratch_file("lone.ply"), err = scratch_file("stopped.err");
    fs::copy_file(ball_file(), lone, fs::copy_options::overwrite_existing);
    fs::remove(err);
    const std::string stop = fmt::format(
        "'{}' mesh '{}' -o '{}' --texture splats 2> '{}' > /dev/null & "
        "while ! grep -q '^cameras: 32' '{}'; do kill -0 $! || exit 3; done; "
        "kill -INT $!; wait $!",
        DARB_COMMAND, lone, scratch_file("stopped.obj"), err, err);
    const int status = std::system(stop.c_str());
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 128 + SIGINT) << read_text_file(err);
    EXPECT_NE(read_text_file(err).find("nothing was written"), std::string::npos);
    for (const auto& entry : fs::directory_iterator(scratch()))
        EXPECT_FALSE(entry.path().filename().string().starts_with("stopped.obj") ||
                     entry.path().filename().string().starts_with("stopped_") ||
                     entry.path().filename() == "stopped.mtl")
            << entry.path();
}

TEST(MeshCommand, Says_what_is_wrong_and_leaves_no_file) {
    const std::string shapes = scratch_file("shapes.json"), in_mm = scratch_file("in_mm.obj");
    write_file_atomic(shapes, R"({"shapes": [{"shape": "sphere", "size": [1, 0, 0],
        "position": [0, 0, 0], "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}]})");
    write_file_atomic(in_mm,
                      "v 900 0 0\nv 0 900 0\nv 0 0 900\nv -900 -900 -900\n"
                      "f 1 2 3\nf 1 4 2\nf 2 4 3\nf 3 4 1\n");
    const std::pair<std::string, std::string> cases[] = {
        {mesh_of("ball.stl"), "has no ending of a mesh"},
        {mesh_of("a.ply", "--bounds 1,2,3"), "is not 6 numbers"},
        {mesh_of("a.ply", "--bounds 1,1,1,0,2,2"), "hold nothing"},
        {mesh_of("a.ply", "--bounds 5,5,5,6,6,6"), "Widen --bounds"},
        {mesh_of("a.ply", "--max-memory lots"), "is no size"},
        {mesh_of("a.ply", "--level 0"), "--level"},
        {mesh_of("a.ply", "--thresholds 1"), "--reference"},
        {mesh_of("a.ply", "--near 9"), "no surface is seen by two of the 14 views"},
        {mesh_of("a.ply", "--min-island 100000000"), "nothing is left"},
        {mesh_of("a.ply", "--texture photos"), "Write .glb, .gltf or .obj"},
        {mesh_of("a.glb", "--texture photos"), "has cameras without photos"},
        {mesh_of("a.obj", "--texture splats --texel 1e-6"), "--texel"},
        {mesh_of("a.ply", "--texture photos --collider object"), "--collider"},
        {mesh_of("a.ply", "--capsule 0.2,1.6"), "--collider"},
        {mesh_of("a.ply", "--collider object --capsule 1,1"), "a radius and a height"},
        {mesh_of("a.ply", "--collider object --bounds 50,50,50,51,51,51"), "--bounds"},
        {mesh_of("a.ply", "--collider room --voxel 0.0001"), "(--voxel)"},
        {mesh_of("a.ply", "--align rigid"), "--reference"},
        {mesh_of("a.ply", "--align rigid --reference " + shapes), "stay there"},
        {mesh_of("a.ply", "--reference " + in_mm), "Is it in mm"},
    };
    for (const auto& [arguments, said] : cases) {
        const Outcome o = darb(arguments);
        EXPECT_EQ(o.code, 2) << arguments << o.err;
        EXPECT_NE(o.err.find(said), std::string::npos) << arguments << "\n" << o.err;
    }
    for (const char* name : {"a.ply", "a.glb", "a.obj", "a.mtl", "a_0.png"})
        EXPECT_FALSE(fs::exists(scratch_file(name))) << name;
    EXPECT_FALSE(fs::exists(scratch_file("ball.stl")));
}

}  // namespace
}  // namespace darb::test
