// SPDX-License-Identifier: MIT
#include "tools/python/mesh.h"

#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <limits>
#include <utility>

#include "engine/core/text.h"
#include "engine/data/camera_list.h"
#include "engine/mesh/mesh_file.h"
#include "engine/mesh/scene_mesh.h"
#include "engine/mesh/topology.h"
#include "engine/scene/subject.h"
#include "tools/python/cameras.h"
#include "tools/python/scene.h"

namespace darb::python {

namespace {

constexpr double kLargestNumber = std::numeric_limits<double>::max(), kLeastLength = 1e-12;
constexpr long long kMostFaces = 2'000'000'000;

/// The option's value, or nothing for None.
std::optional<py::object> given(const py::dict& options, const char* name) {
    py::object value = options[name];
    if (value.is_none()) return std::nullopt;
    return value;
}

double length_or_0(const py::dict& options, const char* name) {
    const auto value = given(options, name);
    return value ? take_number(*value, name, kLeastLength, kLargestNumber) : 0;
}

std::size_t count_or_0(const py::dict& options, const char* name) {
    const auto value = given(options, name);
    return value ? static_cast<std::size_t>(take_integer(*value, name, 0, kMostFaces)) : 0;
}

/// A sequence of numbers, or an array; count: kAny for any.
std::vector<double> take_numbers(const py::object& value, const char* name, py::ssize_t count) {
    if (!py::isinstance<py::tuple>(value) && !py::isinstance<py::list>(value))
        return take_doubles(value, name, {count});
    std::vector<double> numbers;
    for (const py::handle one : value)
        numbers.push_back(take_number(py::reinterpret_borrow<py::object>(one), name,
                                      -kLargestNumber, kLargestNumber));
    if (count != kAny && static_cast<py::ssize_t>(numbers.size()) != count)
        throw Error(name, fmt::format("has {} numbers", numbers.size()),
                    fmt::format("Give {}.", count));
    return numbers;
}

std::optional<WorldBox> take_bounds(const py::dict& options, const glm::dvec3& origin) {
    const auto value = given(options, "bounds");
    if (!value) return std::nullopt;
    const std::vector<double> b = take_numbers(*value, "bounds", 6);
    const glm::dvec3 low(b[0], b[1], b[2]), high(b[3], b[4], b[5]);
    if (!glm::all(glm::lessThan(low, high)))
        throw Error("bounds", "hold nothing: a least number is not below its largest",
                    "Give the least x, y, z and then the largest.");
    return WorldBox{low - origin, high - origin};
}

SceneMeshOptions take_options(const py::dict& options, const glm::dvec3& origin, int kernel) {
    SceneMeshOptions o;
    o.reading = usual_reading(kernel);
    if (given(options, "depth")) {
        const std::string depth = take_text(options["depth"], "depth");
        const auto reading = depth_reading_from_name(depth);
        if (!reading)
            throw Error("depth " + depth, "no such reading",
                        "Use front, solid, plane or expected.");
        o.reading = *reading;
    }
    const std::string named = take_text(options["method"], "method");
    const auto method = mesh_method_from_name(named);
    if (!method) throw Error("method " + named, "no such method", "Use tsdf or opacity.");
    o.method = *method;
    const std::string texture = take_text(options["texture"], "texture");
    const auto texturing = mesh_texturing_from_name(texture);
    if (!texturing)
        throw Error("texture " + texture, "no such texture", "Use none, vertex, splats or photos.");
    o.texture = *texturing;
    o.level = static_cast<float>(take_number(options["level"], "level", 0.01, 0.99));
    o.near_plane = static_cast<float>(take_number(options["near"], "near", 1e-6, 1e30));
    o.tsdf.voxel = length_or_0(options, "voxel");
    o.tsdf.truncation = static_cast<int>(take_integer(options["truncation"], "truncation", 2, 16));
    o.tsdf.farthest = length_or_0(options, "far");
    o.tsdf.bounds = take_bounds(options, origin);
    o.faces = count_or_0(options, "faces");
    o.keep = count_or_0(options, "keep");
    o.min_island = count_or_0(options, "min_island");
    o.fill_holes = length_or_0(options, "fill_holes");
    o.texel = length_or_0(options, "texel");
    const std::string seams = take_text(options["seams"], "seams");
    if (seams != "level" && seams != "keep")
        throw Error("seams " + seams, "no such way", "Use level or keep.");
    if (seams == "keep" && o.texture != MeshTexturing::photos)
        throw Error("seams keep", "only photos have seams",
                    "Take texture photos, or leave seams out.");
    o.level_seams = seams == "level";
    return o;
}

/// Those of viewmats and Ks, else those of the file or data set; none where nothing is named.
std::vector<View> take_views(const py::dict& options) {
    const auto path = given(options, "cameras");
    if (given(options, "viewmats")) {
        if (path) throw Error("cameras", "are given beside viewmats", "Leave one of them out.");
        const auto side = [&](const char* name) {
            if (!given(options, name))
                throw Error(name, "is missing beside viewmats", "Give the pictures' size, px.");
            return static_cast<int>(take_integer(options[name], name, 1, 1 << 20));
        };
        const int width = side("width"), height = side("height");
        std::vector<View> views;
        for (const Camera& camera :
             take_cameras(options["viewmats"], options["Ks"], width, height)) {
            View view;
            view.name = fmt::format("camera {}", views.size());
            view.camera = camera;
            views.push_back(view);
        }
        return views;
    }
    if (!path) return {};
    DatasetOptions data;
    data.resolution =
        static_cast<int>(take_integer(options["resolution"], "resolution", -1, 1 << 20));
    const std::string file = take_path(*path, "cameras");
    const py::gil_scoped_release free;
    return load_cameras(file, data);
}

MeshPhotos take_photos(const py::dict& options) {
    const auto path = given(options, "cameras");
    MeshPhotos photos;
    if (path) {
        const std::string file = take_path(*path, "cameras");
        const py::gil_scoped_release free;
        photos.views = load_cameras(file);
    }
    std::erase_if(photos.views, [](const View& view) {
        return view.photo.empty() || !std::filesystem::exists(view.photo);
    });
    if (photos.views.empty())
        throw Error("texture photos", "there are no photos",
                    "Name the data set of the scene's photos as cameras=.");
    return photos;
}

std::optional<ReferenceOptions> take_reference(const py::dict& options) {
    const auto path = given(options, "reference");
    const auto align = given(options, "align"), thresholds = given(options, "thresholds");
    if (!path) {
        if (align || thresholds)
            throw Error(align ? "align" : "thresholds", "is given without a reference",
                        "Name one as reference=.");
        return std::nullopt;
    }
    ReferenceOptions reference{take_path(*path, "reference"), {}, {}};
    if (thresholds) reference.thresholds = take_numbers(*thresholds, "thresholds", kAny);
    for (const double t : reference.thresholds)
        if (!(t > 0)) throw Error("thresholds", "has one that is not above 0", "Give distances.");
    if (align) {
        const std::string name = take_text(*align, "align");
        reference.align = align_kind_from_name(name);
        if (!reference.align)
            throw Error("align " + name, "no such kind", "Use rigid or similarity.");
    }
    return reference;
}

/// Ctrl-C ends the work.
MeshProgress listening() {
    return [last = std::chrono::steady_clock::now()](const char*, double) mutable {
        const auto now = std::chrono::steady_clock::now();
        if (now - last < std::chrono::milliseconds(50)) return;
        last = now;
        check_signals();
    };
}

// What comes back.

template <class V, class T>
py::object rows_of(const std::vector<V>& values) {
    if (values.empty()) return py::none();
    std::vector<T> flat;
    for (const V& value : values)
        for (int c = 0; c < 3; ++c) flat.push_back(value[c]);
    return into_array(std::move(flat), {static_cast<py::ssize_t>(values.size()), 3});
}

py::array vertices_of(const TriangleMesh& mesh) {
    std::vector<double> flat;
    for (const glm::vec3& p : mesh.position)
        for (int c = 0; c < 3; ++c) flat.push_back(double{p[c]} + mesh.origin[std::size_t(c)]);
    return into_array(std::move(flat), {static_cast<py::ssize_t>(mesh.vertex_count()), 3});
}

py::array faces_of(const TriangleMesh& mesh) {
    std::vector<std::uint32_t> flat;
    for (const auto& face : mesh.face) flat.insert(flat.end(), face.begin(), face.end());
    return into_array(std::move(flat), {static_cast<py::ssize_t>(mesh.face_count()), 3});
}

void add_texture(const MeshTexture& texture, py::dict& info) {
    std::vector<float> uv;
    for (const auto& face : texture.uv)
        for (const glm::vec2& corner : face) uv.insert(uv.end(), {corner.x, corner.y});
    const auto faces = static_cast<py::ssize_t>(texture.uv.size());
    info["uv"] = into_array(std::move(uv), {faces, 3, 2});
    info["page"] = to_array(texture.page, {faces});
    py::list pages;
    for (const ImageU8& page : texture.image)
        pages.append(to_array(page.data, {page.height, page.width, page.channels}));
    info["pages"] = pages;
}

py::dict distances_dict(const DistanceStatistics& d) {
    py::dict result;
    result["samples"] = d.samples;
    result["mean"] = d.mean;
    result["median"] = d.median;
    result["p90"] = d.p90;
    result["largest"] = d.largest;
    return result;
}

void add_comparison(const ReferenceComparison& found, py::dict& info) {
    const MeshComparison& c = found.comparison;
    py::dict result;
    result["accuracy"] = distances_dict(c.accuracy);
    result["completeness"] = distances_dict(c.completeness);
    result["bias"] = c.bias;
    result["normal_degrees"] = c.normal_degrees;
    result["chamfer"] = c.chamfer;
    py::list scores;
    for (const FScore& f : c.f_scores)
        scores.append(py::make_tuple(f.threshold, f.precision, f.recall, f.f()));
    result["f_scores"] = scores;
    info["comparison"] = result;
    if (!found.alignment) return;
    const Alignment& a = *found.alignment;
    std::vector<double> matrix;
    for (int r = 0; r < 3; ++r) {
        for (int k = 0; k < 3; ++k) matrix.push_back(a.scale * a.rotation[k][r]);
        matrix.push_back(a.shift[r]);
    }
    matrix.insert(matrix.end(), {0, 0, 0, 1});
    info["alignment"] = to_array(matrix, {4, 4});
}

py::tuple arrays_of(const TriangleMesh& mesh, py::dict info) {
    info["normals"] = rows_of<glm::vec3, float>(mesh.normal);
    return py::make_tuple(vertices_of(mesh), faces_of(mesh),
                          rows_of<glm::u8vec3, std::uint8_t>(mesh.colour), info);
}

void write_output(const py::dict& options, const TriangleMesh& mesh,
                  const std::optional<MeshTexture>& texture) {
    const auto path = given(options, "output");
    if (!path) return;
    const std::string file = take_path(*path, "output");
    const py::gil_scoped_release free;
    write_mesh(file, mesh, texture ? &*texture : nullptr);
}

py::tuple surface(PyDevice& device, const PyScene& scene, const py::dict& options) {
    const SceneMeshOptions o = take_options(options, scene.model().origin, scene.model().kernel);
    const auto reference = take_reference(options);
    std::vector<View> views = take_views(options);
    std::optional<MeshPhotos> photos;
    if (o.texture == MeshTexturing::photos) photos = take_photos(options);
    SceneMesh made;
    std::optional<ReferenceComparison> found;
    {
        const py::gil_scoped_release free;
        const auto lock = device.lock();
        if (views.empty()) views = mesh_views_around(scene.model());
        made = mesh_scene(device.device(), scene.model(), std::move(views), o,
                          photos ? &*photos : nullptr, listening());
        if (reference) found = compare_with_reference(made, *reference);
    }
    write_output(options, made.mesh, made.texture);
    const SceneMeshReport& r = made.report;
    py::dict info;
    info["voxel"] = r.tsdf.voxel;
    info["views"] = r.views;
    info["blocks"] = r.tsdf.blocks;
    info["thin_share"] = r.thin_share;
    info["parts_removed"] = r.clean.parts_removed;
    info["holes_filled"] = r.clean.holes_filled;
    info["simplified_by"] = r.simplified_by ? py::cast(*r.simplified_by) : py::none();
    if (made.texture) add_texture(*made.texture, info);
    if (found) add_comparison(*found, info);
    return arrays_of(made.mesh, info);
}

py::tuple collider(const PyScene& scene, const std::string& name, const py::dict& options) {
    const auto kind = collider_kind_from_name(name);
    if (!kind) throw Error("collider " + name, "no such kind", "Use room, ground or object.");
    SceneColliderOptions o;
    o.collider.kind = *kind;
    if (const std::size_t faces = count_or_0(options, "faces")) o.collider.faces = faces;
    const std::vector<double> capsule = take_numbers(options["capsule"], "capsule", 2);
    o.collider.radius = capsule[0];
    o.collider.height = capsule[1];
    if (!(capsule[0] > 0 && capsule[1] >= 2 * capsule[0]))
        throw Error("capsule", "is not a radius and a height of twice it",
                    "Give them in world units, as (0.2, 1.6).");
    o.cell = length_or_0(options, "voxel");
    o.bounds = take_bounds(options, scene.model().origin);
    const std::vector<Camera> cameras = cameras_of(take_views(options));
    if (const auto up = given(options, "up"))
        o.up = up_from_name(take_text(*up, "up"));
    else
        o.up = up_of_cameras(cameras).value_or(guess_up(scene.model()));
    SceneCollider made;
    {
        const py::gil_scoped_release free;
        made = collide_scene(scene.model(), cameras, o, listening());
    }
    write_output(options, made.mesh, std::nullopt);
    const Topology topology = topology_of(made.mesh);
    py::dict info;
    info["voxel"] = made.cell;
    info["parts"] = topology.parts;
    info["closed"] = topology.is_closed() && topology.is_manifold();
    return arrays_of(made.mesh, info);
}

}  // namespace

void bind_mesh(py::module_& module) {
    module.def("mesh", [](const std::shared_ptr<PyDevice>& device, const PyScene& scene,
                          const py::dict& options) {
        if (scene.model().size() == 0)
            throw Error("mesh", "the scene has no splats", "Mesh one that has some.");
        if (const auto path = given(options, "output"))
            if (const std::filesystem::path file = take_path(*path, "output");
                file.extension().empty() ||
                mesh_endings().find(file.extension().string()) == std::string::npos)
                throw Error(file.string(), "has no ending of a mesh",
                            "Use " + mesh_endings() + ".");
        if (const auto kind = given(options, "collider"))
            return collider(scene, take_text(*kind, "collider"), options);
        return surface(*device, scene, options);
    });
}

}  // namespace darb::python
