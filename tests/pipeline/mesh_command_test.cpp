// SPDX-License-Identifier: MIT
// darb mesh, as a user runs it: files, reports, errors, the same bits again and within less memory.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "engine/core/files.h"
#include "engine/mesh/mesh_file.h"
#include "engine/scene/ply.h"
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

const std::string& cameras_file() {
    static const std::string path = [] {
        nlohmann::json list = nlohmann::json::array();
        for (int i = 0; i < 14; ++i) {
            const double y = 1 - (2.0 * i + 1) / 14, r = std::sqrt(1 - y * y), a = 2.39996323 * i;
            const glm::dvec3 from = 3.4 * glm::dvec3(r * std::cos(a), y, r * std::sin(a));
            const glm::dvec3 forward = -glm::normalize(from);
            const glm::dvec3 right = glm::normalize(glm::cross(glm::dvec3(.1, 1, .05), forward));
            const glm::dvec3 down = glm::cross(forward, right);
            nlohmann::json rows = nlohmann::json::array();
            for (int k = 0; k < 3; ++k) rows.push_back({right[k], down[k], forward[k]});
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
    return fmt::format("mesh '{}' --cameras '{}' -o '{}' --voxel 0.1 {}", ball_file().string(),
                       cameras_file(), scratch_file(output), more);
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

TEST(MeshCommand, Says_what_is_wrong_and_leaves_no_file) {
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
    };
    for (const auto& [arguments, said] : cases) {
        const Outcome o = darb(arguments);
        EXPECT_EQ(o.code, 2) << arguments << o.err;
        EXPECT_NE(o.err.find(said), std::string::npos) << arguments << "\n" << o.err;
    }
    EXPECT_FALSE(fs::exists(scratch_file("a.ply")));
    EXPECT_FALSE(fs::exists(scratch_file("ball.stl")));
}

}  // namespace
}  // namespace darb::test
