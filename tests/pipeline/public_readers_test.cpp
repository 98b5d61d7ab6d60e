// SPDX-License-Identifier: MIT
// What darb writes, as public readers see it, and what a public writer writes, as darb sees it.
// Needs node and the npm packages gltf-validator, @gltf-transform/core and
// @playcanvas/splat-transform; see docs/formats.md.
#include <cmath>
#include <cstdlib>
#include <glm/gtc/quaternion.hpp>
#include <nlohmann/json.hpp>
#include <sstream>

#include "engine/mesh/mesh_file.h"
#include "engine/scene/dot_splat.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/sog.h"
#include "engine/scene/splat_file.h"
#include "tests/support/ksplat_file.h"
#include "tests/support/mesh_shapes.h"
#include "tests/support/run_command.h"
#include "tests/support/splat_files.h"

namespace darb::test {
namespace {

using nlohmann::json;

class PublicReaders : public testing::Test {
  protected:
    void SetUp() override {
        const char* folder = std::getenv("DARB_NODE_MODULES");
        if (!folder || !fs::is_directory(fs::path(folder) / "node_modules"))
            GTEST_SKIP()
                << "no npm packages: npm install gltf-validator @gltf-transform/core "
                   "@playcanvas/splat-transform in a folder, and name it by DARB_NODE_MODULES";
        packages_ = folder;
    }

    std::string out_of(const std::string& command) const {
        const std::string out = scratch() / "node_out", err = scratch() / "node_err";
        const int status = std::system(fmt::format("{} > '{}' 2> '{}'", command, out, err).c_str());
        EXPECT_EQ(status, 0) << command << "\n" << read_text_file(out) << read_text_file(err);
        return read_text_file(out);
    }

    /// Through PlayCanvas's converter; returns what was written.
    std::string through_playcanvas(const std::string& from, const std::string& name) const {
        const std::string to = scratch() / name;
        out_of(fmt::format(
            "node '{}' -q -w '{}' '{}'",
            (packages_ / "node_modules/@playcanvas/splat-transform/bin/cli.mjs").string(), from,
            to));
        return to;
    }

    std::string written(const std::string& name, const SplatModel& model) const {
        const std::string path = scratch() / name;
        save_splats(path, *format_to_write(path), model);
        return path;
    }

    fs::path packages_;
};

/// 1 where both splats lie alike: half a turn about an axis of its own changes none.
double same_ellipsoid(const SplatModel& a, const SplatModel& b, size_t i) {
    const float *p = &a.rotation[4 * i], *q = &b.rotation[4 * i];
    const glm::dquat one = glm::normalize(glm::dquat(p[0], p[1], p[2], p[3])),
                     other = glm::normalize(glm::dquat(q[0], q[1], q[2], q[3]));
    const glm::dquat between = glm::conjugate(one) * other;
    return std::max(
        {std::abs(between.w), std::abs(between.x), std::abs(between.y), std::abs(between.z)});
}

void expect_alike(const SplatModel& a, const SplatModel& b, double tolerance) {
    ASSERT_EQ(a.size(), b.size());
    ASSERT_EQ(a.sh_degree, b.sh_degree);
    for (size_t i = 0; i < a.size(); ++i) {
        EXPECT_LT(glm::distance(position_of(a, i), position_of(b, i)), tolerance) << i;
        EXPECT_NEAR(opacity_of(a.opacity_logit[i]), opacity_of(b.opacity_logit[i]), tolerance);
        EXPECT_NEAR(same_ellipsoid(a, b, i), 1, tolerance) << i;
    }
    const auto near = [&](const std::vector<float>& x, const std::vector<float>& y) {
        ASSERT_EQ(x.size(), y.size());
        for (size_t i = 0; i < x.size(); ++i) ASSERT_NEAR(x[i], y[i], tolerance) << i;
    };
    near(a.log_scale, b.log_scale);
    near(a.sh_dc, b.sh_dc);
    near(a.sh_rest, b.sh_rest);
}

TEST_F(PublicReaders, gltf_is_valid_and_says_what_it_should) {
    SplatModel model = sample_model(3, 30);
    model.kernel = KERNEL_RAISED_COSINE;
    const std::string files[] = {written("plain.glb", sample_model(1, 30)),
                                 written("kernel.glb", model), written("a b.gltf", model)};
    std::string command = fmt::format("node '{}/tests/support/public_readers.mjs' '{}'",
                                      DARB_SOURCE_DIR, packages_.string());
    for (const std::string& file : files) command += " '" + file + "'";
    std::istringstream lines(out_of(command));
    const SplatModel shown = as_gaussians(model, false);
    for (const std::string& file : files) {
        std::string line;
        ASSERT_TRUE(std::getline(lines, line)) << file;
        const json seen = json::parse(line);
        EXPECT_TRUE(seen["issues"].empty()) << file << "\n" << seen["issues"].dump(2);
        EXPECT_EQ(seen["mode"], 0);
        EXPECT_EQ(seen["splats"], 30);
        EXPECT_EQ(seen["attributes"].size(), file == files[0] ? 9u : 21u);
        EXPECT_EQ(seen["rotation"], json({1, 0, 0, 0}));
        if (file == files[0]) continue;
        for (size_t i = 0; i < 6; ++i) {
            EXPECT_EQ(seen["position"][i].get<float>(), model.position[i]);
            EXPECT_NEAR(seen["scale"][i].get<double>(), std::exp(shown.log_scale[i]), 1e-5);
            EXPECT_NEAR(seen["opacity"][i].get<double>(), opacity_of(shown.opacity_logit[i]), 1e-6);
        }
    }
}

TEST_F(PublicReaders, meshes_as_gltf_are_valid) {
    TriangleMesh mesh = sphere_mesh(0.7, 8, 9);
    MeshTexture texture;
    texture.image = {ImageU8(16, 8, 3), ImageU8(8, 16, 3)};
    for (std::uint32_t f = 0; f < mesh.face_count(); ++f) {
        texture.uv.push_back({glm::vec2(0), glm::vec2(1, 0), glm::vec2(0, 1)});
        texture.page.push_back(f % 2);
    }
    std::vector<std::string> files = {scratch() / "t.glb", scratch() / "t t.gltf"};
    for (const std::string& file : files) write_mesh(file, mesh, &texture);
    mesh.colour.assign(mesh.vertex_count(), glm::u8vec3(1, 200, 30));
    mesh.origin = {1e6, 2, 3};
    files.push_back(scratch() / "colours.glb");
    write_mesh(files.back(), mesh);
    std::string command = fmt::format("node '{}/tests/support/public_readers.mjs' '{}'",
                                      DARB_SOURCE_DIR, packages_.string());
    for (const std::string& file : files) command += " '" + file + "'";
    std::istringstream lines(out_of(command));
    for (const std::string& file : files) {
        std::string line;
        ASSERT_TRUE(std::getline(lines, line)) << file;
        const json seen = json::parse(line);
        EXPECT_TRUE(seen["issues"].empty()) << file << "\n" << seen["issues"].dump(2);
        EXPECT_EQ(seen["mode"], 4);
        EXPECT_EQ(seen["attributes"].size(), 3u) << file;
    }
}

TEST_F(PublicReaders, playcanvas_reads_the_sog_that_is_written) {
    const SplatModel model = sample_model(2, 1500);
    const std::string zip = written("p.sog", model), folder = written("p/meta.json", model);
    const SplatModel ours = load_splats(zip);
    expect_alike(ours, load_splats(through_playcanvas(zip, "from_zip.ply")), 1e-4);
    expect_alike(ours, load_splats(through_playcanvas(folder, "from_folder.ply")), 1e-4);
    // Its converter writes streamed SOG and reads the scenes of its levels.
    const std::string streamed = scratch() / "s/lod-meta.json";
    const Outcome o = darb("convert '" + written("s.ply", model) + "' '" + streamed +
                           "' --levels 2 --splats 600");
    ASSERT_EQ(o.code, 0) << o.err;
    const size_t counts[] = {1500, 600, 300};
    for (size_t level = 0; level < 3; ++level) {
        const std::string part = fmt::format("{}_0/meta.json", level);
        const SplatModel theirs = load_splats(through_playcanvas(
            fs::path(streamed).parent_path() / part, fmt::format("from_{}.ply", level)));
        EXPECT_EQ(theirs.size(), counts[level]);
        expect_alike(load_streamed_level(streamed, level), theirs, 1e-4);
    }
}

TEST_F(PublicReaders, both_read_the_same_of_other_formats) {
    const SplatModel model = sample_model(3, 200);
    EncodeOptions old;
    old.spz_version = 3;
    const std::string spz = scratch() / "old.spz", ksplat = scratch() / "a.ksplat";
    write_encoded(spz, encode_scene(SplatFormat::spz, model, spz, old));
    expect_alike(load_splats(spz), load_splats(through_playcanvas(spz, "from_spz.ply")), 1e-4);
    for (const int level : {0, 1, 2}) {
        write_file_atomic(ksplat, ksplat_file(level, 2));
        expect_alike(load_splats(ksplat), load_splats(through_playcanvas(ksplat, "from_k.ply")),
                     1e-4);
    }
    // Half a turn about y lies between both, which are y up.
    const SplatModel theirs =
        load_splats(through_playcanvas(written("m.ply", model), "theirs.glb"));
    SplatModel turned = model;
    transform_splats({1, glm::dmat3(-1, 0, 0, 0, 1, 0, 0, 0, -1), glm::dvec3(0.0)}, turned);
    expect_alike(theirs, turned, 1e-4);
}

}  // namespace
}  // namespace darb::test
