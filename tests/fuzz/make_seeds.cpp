// SPDX-License-Identifier: MIT
// make_seeds CORPUS: a few small, whole files for each fuzzer, in CORPUS/FUZZER, of every format
// and version; each is read once, so that a seed always reaches what comes after acceptance. The
// fuzzers of tools/fuzz.sh start from them.
#include <fmt/format.h>
#include <webp/encode.h>
#include <zip.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/data/camera_list.h"
#include "engine/data/colmap.h"
#include "engine/data/image_io.h"
#include "engine/data/transforms.h"
#include "engine/kernels/kernel_definition.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/mesh/mesh_file.h"
#include "engine/scene/edit_script.h"
#include "engine/scene/inflate.h"
#include "engine/scene/project_file.h"
#include "engine/scene/splat_file.h"
#include "engine/scene/spz.h"
#include "tests/support/ksplat_file.h"
#include "tests/support/las_file.h"
#include "tests/support/lcc_files.h"
#include "tests/support/mesh_shapes.h"
#include "tests/support/photo_files.h"
#include "tests/support/test_scene.h"
#include "trainer/step/checkpoint.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;
using FileBytes = std::vector<std::byte>;
using nlohmann::json;

constexpr std::size_t kSplats = 3;

FileBytes bytes_of(std::string_view text) {
    const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
    return {bytes.begin(), bytes.end()};
}

SplatModel sample_model(int degree) {
    return random_scene({.count = kSplats, .sh_degree = degree}).model;
}

/// A splat file, as a seed of its own fuzzer and of that which takes any format.
void add_scene(const fs::path& corpus, const char* fuzzer, const std::string& name,
               const FileBytes& file) {
    DARB_CHECK(parse_splats(file, name).size() > 0, "{}", name);
    write_file_atomic(corpus / fuzzer / name, file);
    write_file_atomic(corpus / "splat_file" / (std::string(fuzzer) + "_" + name), file);
}

std::string ascii_ply(const SplatModel& model) {
    std::string text = fmt::format(
        "ply\nformat ascii 1.0\ncomment SplatKernel: sinc\nelement vertex {}\n", model.size());
    for (const char* name : {"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0",
                             "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"})
        text += fmt::format("property float {}\n", name);
    text += "end_header\n";
    for (std::size_t i = 0; i < model.size(); ++i) {
        const auto put = [&](const std::vector<float>& values, std::size_t width) {
            for (std::size_t k = 0; k < width; ++k)
                text += fmt::format("{} ", values[width * i + k]);
        };
        put(model.position, 3);
        put(model.sh_dc, 3);
        put(model.opacity_logit, 1);
        put(model.log_scale, 3);
        put(model.rotation, 4);
        text += "\n";
    }
    return text;
}

/// Colours in bytes, no third scale, a blur of its own: ply_dialects.h.
std::string dialects_ply() {
    std::string text =
        "ply\nformat ascii 1.0\ncomment antialiased 1\nelement vertex 1\n"
        "property float x\nproperty float y\nproperty float z\nproperty float nx\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    for (const char* name :
         {"opacity", "scale_0", "scale_1", "rot_0", "rot_1", "rot_2", "rot_3", "filter_3D"})
        text += fmt::format("property float {}\n", name);
    return text + "end_header\n1 2 3 0 255 128 0 0.5 -1 -2 1 0 0 0 0.01\n";
}

/// Versions 1 to 3 before gzip: a header of 16 bytes, the attributes, an extension record.
FileBytes old_spz(std::uint32_t version, int degree) {
    FileBytes file = bytes_of("NGSP");
    const auto put = [&](std::uint32_t value) {
        for (int shift = 0; shift < 32; shift += 8) file.push_back(std::byte(value >> shift & 255));
    };
    put(version);
    put(kSplats);
    for (const int b : {degree, 12, int{spz::kFlagExtensions}, 0}) file.push_back(std::byte(b));
    const std::size_t attributes =
        kSplats * spz::strides(static_cast<int>(version), degree).total();
    for (std::size_t i = 0; i < attributes; ++i) file.push_back(std::byte(40 + 7 * i % 80));
    put(spz::kCoordinateSystem);
    put(4);
    put(6);
    return file;
}

FileBytes webp(int width, int height, int step) {
    std::vector<std::uint8_t> rgba(static_cast<std::size_t>(4 * width * height), 255);
    for (std::size_t i = 0; i < rgba.size(); ++i)
        if (i % 4 != 3) rgba[i] = static_cast<std::uint8_t>(static_cast<int>(i) * step % 256);
    std::uint8_t* out = nullptr;
    const std::size_t size = WebPEncodeLosslessRGBA(rgba.data(), width, height, 4 * width, &out);
    FileBytes bytes(size);
    std::memcpy(bytes.data(), out, size);
    WebPFree(out);
    return bytes;
}

FileBytes sog(const fs::path& scratch, bool harmonics) {
    const json book = json::array({-3, -2, -1, 0, 1, 2, 3, 4});
    json meta = {{"version", 2},
                 {"count", kSplats},
                 {"means", {{"mins", {-1, 0, 0}}, {"maxs", {1, 2, 4}}, {"files", {"l", "u"}}}},
                 {"scales", {{"codebook", book}, {"files", {"s"}}}},
                 {"quats", {{"files", {"q"}}}},
                 {"sh0", {{"codebook", book}, {"files", {"c"}}}}};
    if (harmonics)
        meta["shN"] = {{"count", 64}, {"bands", 1}, {"codebook", book}, {"files", {"p", "n"}}};
    const FileBytes text = bytes_of(meta.dump());
    const FileBytes small = webp(3, 1, 1), indices = webp(3, 1, 0), palette = webp(192, 1, 0);
    const std::pair<const char*, const FileBytes*> parts[] = {
        {"meta.json", &text}, {"l", &small},   {"u", &small},   {"s", &indices},
        {"q", &small},        {"c", &indices}, {"p", &palette}, {"n", &indices}};
    fs::remove(scratch);
    zip_t* zip = zip_open(scratch.c_str(), ZIP_CREATE, nullptr);
    DARB_CHECK(zip, "{}", scratch.string());
    for (const auto& part : parts)
        zip_file_add(zip, part.first,
                     zip_source_buffer(zip, part.second->data(), part.second->size(), 0), 0);
    DARB_CHECK(zip_close(zip) == 0);
    const FileBytes file = read_file(scratch);
    fs::remove(scratch);
    return file;
}

/// Two nodes with one splat, whose values are four zeros of bytes each.
std::string gltf_text() {
    json accessors = json::array(), attributes;
    const std::pair<const char*, std::pair<int, const char*>> rows[] = {
        {"POSITION", {5126, "VEC3"}},
        {"KHR_gaussian_splatting:SCALE", {5126, "VEC3"}},
        {"KHR_gaussian_splatting:ROTATION", {5120, "VEC4"}},
        {"KHR_gaussian_splatting:OPACITY", {5121, "SCALAR"}},
        {"COLOR_0", {5121, "VEC4"}}};
    for (const auto& row : rows) {
        attributes[row.first] = accessors.size();
        accessors.push_back({{"bufferView", 0},
                             {"componentType", row.second.first},
                             {"type", row.second.second},
                             {"normalized", row.second.first != 5126},
                             {"count", 1}});
    }
    const json primitive = {{"attributes", attributes},
                            {"mode", 0},
                            {"extensions", {{"KHR_gaussian_splatting", json::object()}}}};
    return json{{"asset", {{"version", "2.0"}}},
                {"nodes",
                 {{{"children", {1}}, {"scale", {2, 2, 2}}},
                  {{"mesh", 0}, {"rotation", {1, 0, 0, 0}}, {"translation", {1, 2, 3}}}}},
                {"meshes", {{{"primitives", {primitive}}}}},
                {"accessors", accessors},
                {"bufferViews", {{{"buffer", 0}, {"byteLength", 12}}}},
                {"buffers", {{{"byteLength", 12}, {"uri", "data:;base64,AAAAAAAAAAAAAAAA"}}}}}
        .dump();
}

void make_scenes(const fs::path& corpus) {
    for (const int degree : {0, 1, 3}) {
        const SplatModel model = sample_model(degree);
        const std::string name = fmt::format("degree_{}", degree);
        add_scene(corpus, "ply", name, encode_splats(SplatFormat::ply, model));
        add_scene(corpus, "compressed_ply", name,
                  encode_splats(SplatFormat::compressed_ply, model));
        add_scene(corpus, "spz", name + "_version_4", encode_splats(SplatFormat::spz, model));
        add_scene(corpus, "gltf", name, encode_splats(SplatFormat::gltf, model));
        add_scene(corpus, "sog", name + "_written", encode_splats(SplatFormat::sog, model));
        for (const std::uint32_t version : {1u, 2u, 3u}) {
            const FileBytes plain = old_spz(version, degree);
            const std::string old = fmt::format("{}_version_{}", name, version);
            add_scene(corpus, "spz", old, plain);
            add_scene(corpus, "spz", old + "_gzip", gzip(plain));
        }
    }
    SplatModel own = sample_model(0);
    own.kernel = register_kernel("own", 7, [](double q) { return std::pow(std::cos(q / 5), 2); });
    add_scene(corpus, "ply", "own_kernel", encode_splats(SplatFormat::ply, own));
    write_file_atomic(corpus / "kernel/function",
                      definition_json(*kernel_definition(own.kernel)).dump());
    write_file_atomic(
        corpus / "kernel/table",
        std::string(R"({"name": "t", "table": [[0, 1], [1, 0.75], [2, 0.5], [4, 0]]})"));
    write_file_atomic(corpus / "kernel/expression",
                      std::string(R"([{"expression": "(1 - q/9)^2", "support": 9}])"));
    write_file_atomic(corpus / "kernel/list",
                      std::string("sinc, expr: 0.5 + 0.5*cos(pi*d/3), support 3^2, name a"));
    add_scene(corpus, "ply", "ascii", bytes_of(ascii_ply(sample_model(0))));
    add_scene(corpus, "ply", "dialects", bytes_of(dialects_ply()));
    add_scene(corpus, "dot_splat", "scene.splat",
              encode_splats(SplatFormat::dot_splat, sample_model(0)));
    SplatModel radial = sample_model(1);
    radial.kernel = KERNEL_RAISED_COSINE;
    add_scene(corpus, "gltf", "radial", encode_splats(SplatFormat::gltf, radial));
    add_scene(corpus, "gltf", "data_uri.gltf", bytes_of(gltf_text()));
    add_scene(corpus, "usda", "scene", encode_splats(SplatFormat::usda, sample_model(1)));
    write_file_atomic(corpus / "las/points",
                      las_file({{{1, 2, 3}, {9, 8, 7}}}, {.minor = 4, .format = 7}));
    for (const bool harmonics : {false, true}) {
        const LccScene scene = lcc_scene({}, harmonics);
        FileBytes seed{std::byte(scene.index.size())};
        seed.insert(seed.end(), scene.index.begin(), scene.index.end());
        const FileBytes meta = bytes_of(scene.meta.dump());
        seed.insert(seed.end(), meta.begin(), meta.end());
        write_file_atomic(corpus / "lcc" / (harmonics ? "quality" : "portable"), seed);
    }
    write_file_atomic(corpus / "streamed_sog" / "one_file",
                      encode_scene(SplatFormat::streamed_sog, sample_model(0)).file);
    for (const int level : {0, 1, 2})
        add_scene(corpus, "ksplat", fmt::format("level_{}.ksplat", level), ksplat_file(level, 2));
    for (const bool harmonics : {false, true})
        add_scene(corpus, "sog", harmonics ? "degree_1" : "degree_0",
                  sog(corpus / "scratch.zip", harmonics));
}

/// Inputs of the COLMAP fuzzer begin with a byte that says which file they are.
void make_colmap(const fs::path& corpus) {
    std::vector<View> views(2);
    for (std::size_t i = 0; i < views.size(); ++i) {
        views[i].name = fmt::format("photo {}.png", i);
        views[i].camera = {.width = 8, .height = 6, .fx = 20, .fy = 21, .cx = 4, .cy = 3};
    }
    PointCloud points;
    points.position = {0.5, 0, 4, 1, 2, 3};
    points.colour = {1, 2, 3, 250, 128, 0};
    const fs::path scratch = corpus / "scratch", folder = corpus / "colmap";
    write_colmap_binary(scratch, views, points);
    const auto add = [&](const char* name, int which, const FileBytes& file) {
        FileBytes seed{std::byte(which)};
        seed.insert(seed.end(), file.begin(), file.end());
        write_file_atomic(folder / name, seed);
    };
    DARB_CHECK(read_colmap(scratch).images.size() == views.size());
    add("cameras", 0, read_file(scratch / "cameras.bin"));
    add("images", 1, read_file(scratch / "images.bin"));
    add("points3D", 2, read_file(scratch / "points3D.bin"));
    fs::remove_all(scratch);
    const std::string cameras =
        "# c\n1 OPENCV 200 150 235 235 100 75 0.1 0.01 0 0\n2 FOV 200 150 90 90 100 75 0.9\n";
    const std::string images =
        "1 1 0 0 0 0 0 1 1 a b.png\n\n2 1 0 0 0 0 0 1 2 c.png\n3 4 -1 5 6 7\n";
    const std::string cloud = "1 0.1 0.2 0.3 255 128 0 0.5 1 2\n2 nan 0 0 1 2 3 0.1\n";
    std::size_t dropped = 0;
    DARB_CHECK(parse_colmap_cameras_text(cameras, "seed").size() == 2);
    DARB_CHECK(parse_colmap_images_text(images, "seed").size() == 2);
    DARB_CHECK(parse_colmap_points_text(cloud, "seed", dropped).size() == 1);
    add("cameras_text", 3, bytes_of(cameras));
    add("images_text", 4, bytes_of(images));
    add("points_text", 5, bytes_of(cloud));
}

void make_projects(const fs::path& corpus) {
    const Camera view = random_scene().camera;
    const std::vector<EditOperation> edits{
        edits::Select{Region{Region::Shape::sphere, {0, 0, 0}, glm::dvec3(2)}},
        edits::Select{by::Polygon{view, {{1, 1}, {9, 1}, {5, 8}}}, Combine::add},
        edits::Transform{{2, turn_of_degrees({1, 2, 3}), {1, 0, 0}}, ""},
        edits::Add{"other.ply", "other"},
        edits::Duplicate{"other", "twin"},
        edits::MergeLayers{"other", "twin"},
        edits::ShowLayer{"other", false},
        edits::Remove{by::Numbers{{{0, 1}}}, false},
        edits::StateUnit{0.5}};
    const std::string script = format_edit_script(edits, "");
    DARB_CHECK(parse_edit_script(script, "seed", "").size() == edits.size());
    write_file_atomic(corpus / "project/script", script);
    Project project;
    project.layers = {{"first", "first.ply", true, {}},
                      {"second", "second.ply", false, {2, glm::dmat3(1.0), {1, 2, 3}}}};
    project.edits = edits;
    project.files = {{"first.ply", 12, "fnv1a64:0"}};
    project.measured = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, true};
    const NoteCamera camera{{0, 0, 3}, {1, 0, 0, 0}, 0.8};
    project.notes = {{{1, 2, 3}, "title", "text", camera}};
    project.path = {{0, camera}, {1, camera}};
    project.view = ProjectView{camera, 3, {0, -1, 0}, {0, 0, 0}};
    const std::string text = format_project(project, "");
    DARB_CHECK(parse_project(text, "seed", "").notes.size() == 1);
    write_file_atomic(corpus / "project/project", text);
}

void make_transforms(const fs::path& corpus) {
    const std::string head = "{\"w\": 80, \"h\": 60, \"fl_x\": 50, \"k1\": 0.1, \"k4\": 0.01, ",
                      frame =
                          "{\"file_path\": \"a.png\", \"transform_matrix\": "
                          "[[1,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]]}",
                      text = head + "\"test_filenames\": [\"a.png\"], \"frames\": [" + frame + "]}";
    const TransformsFile file = parse_transforms(text, "seed");
    lens_from_transforms(file.frames.at(0).intrinsics, 80, 60, "seed");
    write_file_atomic(corpus / "transforms/nerfstudio", text);
    View view;
    view.name = "a.png";
    view.camera = {.width = 8, .height = 6, .fx = 20, .fy = 21, .cx = 4, .cy = 3};
    const std::string list = format_camera_list({view});
    DARB_CHECK(parse_camera_list(list, "seed").size() == 1);
    write_file_atomic(corpus / "transforms/cameras", list);
}

void make_meshes(const fs::path& corpus) {
    TriangleMesh mesh = box_mesh(glm::vec3(0), glm::vec3(1, 2, 3));
    mesh.colour.assign(mesh.vertex_count(), glm::u8vec3(9, 8, 7));
    mesh.normal.assign(mesh.vertex_count(), glm::vec3(0, 0, 1));
    const auto add = [&](const std::string& name, const FileBytes& file) {
        DARB_CHECK(parse_mesh(file, name).vertex_count() > 0, "{}", name);
        write_file_atomic(corpus / "mesh" / name, file);
    };
    for (const char* name : {"box.ply", "box.obj", "box.glb"})
        add(name, encode_mesh(mesh, name).file);
    mesh.origin = {1e6, 0, 0};
    add("far.ply", encode_mesh(mesh, "far.ply").file);
    add("ascii.ply", bytes_of("ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\n"
                              "property float y\nproperty float z\nelement face 1\n"
                              "property list uchar int vertex_indices\nend_header\n"
                              "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n"));
    add("quad.obj", bytes_of("v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 1 1 0 1 0 0\nv 0 1 0 1 0 0\n"
                             "vn 0 0 1\nf 1//1 2//1 \\\n3//1 -1//1\n"));
}

void make_photos(const fs::path& corpus) {
    for (const auto& [name, file] : sample_photos()) {
        DARB_CHECK(decode_image(file, name).width > 0, "{}", name);
        write_file_atomic(corpus / "photo" / name, file);
    }
}

void make_checkpoints(const fs::path& corpus) {
    for (const int degree : {0, 2}) {
        Checkpoint c;
        c.state.iteration = 1234;
        c.state.model = sample_model(degree);
        for (int a = 0; a < kAttributeCount; ++a)
            c.state.moments.emplace_back(2 * attribute_values(c.state.model, a).size(), 0.125f);
        c.state.gradient_sum.assign(2 * kSplats, 0.5f);
        c.settings = settings_text({});
        c.dataset = "0123456789abcdef";
        const fs::path path = corpus / "checkpoint" / fmt::format("degree_{}", degree);
        write_checkpoint(path, c);
        parse_checkpoint(read_file(path), path.string());
    }
}

}  // namespace
}  // namespace darb::test

int main(int argc, char** argv) {
    if (argc != 2) {
        fmt::print(stderr, "usage: make_seeds CORPUS\n");
        return 2;
    }
    const std::filesystem::path corpus = argv[1];
    try {
        darb::test::make_scenes(corpus);
        darb::test::make_colmap(corpus);
        darb::test::make_projects(corpus);
        darb::test::make_transforms(corpus);
        darb::test::make_meshes(corpus);
        darb::test::make_photos(corpus);
        darb::test::make_checkpoints(corpus);
    } catch (const std::exception& e) {
        fmt::print(stderr, "make_seeds: {}\n", e.what());
        return 1;
    }
    return 0;
}
