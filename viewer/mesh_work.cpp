// SPDX-License-Identifier: MIT
#include "viewer/mesh_work.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <string_view>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/text.h"
#include "engine/mesh/mesh_file.h"
#include "engine/mesh/scene_mesh.h"
#include "engine/scene/gltf.h"
#include "engine/scene/ply_table.h"
#include "engine/scene/splat_file.h"

namespace darb {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kHead = 1 << 20;  // bytes that say what a file is

struct MeshCancelled {};

bool is_obj(const fs::path& name) {
    return has_extension(name, ".obj");
}

bool has_faces(std::span<const std::byte> head, const std::string& where) try {
    const PlyHeader header = parse_ply_header(head, where);
    const PlyElement* const faces = header.find("face");
    return faces && faces->count > 0 && is_point_cloud(header);
} catch (const Error&) {
    return false;
}

}  // namespace

bool holds_mesh(std::span<const std::byte> head, const fs::path& name) {
    if (looks_like_ply(head)) return has_faces(head, name.string());
    const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
    if (text.starts_with("glTF") || has_extension(name, ".gltf"))
        return text.find("\"meshes\"") != text.npos && text.find(gltf::kSplats) == text.npos;
    return is_obj(name);
}

bool is_mesh_file(const fs::path& file) try {
    std::error_code none;
    if (!fs::is_regular_file(file, none)) return false;
    const std::size_t most =
        has_extension(file, ".gltf") ? std::numeric_limits<std::size_t>::max() : kHead;
    return holds_mesh(read_file_head(file, most), file);
} catch (const Error&) {
    return false;
}

void check_mesh_file(const fs::path& file) {
    read_file_head(file, 1);  // which says what is wrong with a file that cannot be read
    if (is_mesh_file(file)) return;
    throw Error(file.string(), "holds no mesh of triangles",
                "Name one that darb mesh wrote: " + mesh_endings() +
                    ". Splats and points are scenes: darb view SCENE.");
}

ShownMesh shown_mesh_of(TriangleMesh mesh, const fs::path& file, std::vector<std::string> notes) {
    if (mesh.face.empty())
        throw Error(file.string(), "has no faces: it holds points, not a mesh",
                    "Open it as a scene (darb view FILE), or make a mesh: darb mesh SCENE -o "
                    "mesh.glb.");
    if (mesh.colour.empty())
        notes.emplace_back(
            "It has no colours at its vertices and no texture within its file: it is grey.");
    return {std::move(mesh), file, std::move(notes)};
}

ShownMesh read_shown_mesh(const fs::path& file, const MeshProgress& progress) {
    if (progress) progress("reading", 0);
    std::vector<std::string> notes;
    TriangleMesh mesh = read_mesh(file, &notes, {.colours_of_textures = true});
    return shown_mesh_of(std::move(mesh), file, std::move(notes));
}

ShownMesh make_shown_mesh(const DeviceOptions& device_options, const Tuning& tuning,
                          SplatModel model, std::vector<View> views, const MeshWish& wish,
                          const MeshProgress& progress) {
    progress("starting", 0);
    if (model.size() == 0)
        throw Error("mesh", "the scene has no splats", "Mesh one that has some.");
    Device device(device_options);
    device.set_tuning(tuning);
    if (views.empty() || wish.around) views = mesh_views_around(model);
    SceneMeshOptions options;
    options.reading = usual_reading(model.kernel);
    options.method = wish.thin ? MeshMethod::opacity : MeshMethod::tsdf;
    options.tsdf.voxel = double{wish.voxel};
    options.faces = static_cast<std::size_t>(std::max(wish.faces, 0));
    SceneMesh made =
        mesh_scene(device, std::move(model), std::move(views), options, nullptr, progress);
    return {std::move(made.mesh), {}, {}};
}

MeshJob::MeshJob(Work work, std::function<void()> wake)
    : work_(std::move(work)), wake_(std::move(wake)), thread_(std::in_place, [this] { run(); }) {}

void MeshJob::run() {
    try {
        mesh_ = work_([this](const char* what, double share) {
            if (cancelled_) throw MeshCancelled();
            share_ = share;
            {
                const std::lock_guard lock(mutex_);
                stage_ = what;
            }
            if (wake_) wake_();
        });
    } catch (const MeshCancelled&) {
    } catch (const std::bad_alloc&) {
        error_ = std::make_exception_ptr(
            NoRoom("the mesh", "does not fit into memory", "Use larger voxels."));
    } catch (...) {
        error_ = std::current_exception();
    }
    done_ = true;
    if (wake_) wake_();
}

std::string MeshJob::stage() const {
    const std::lock_guard lock(mutex_);
    return stage_;
}

std::optional<ShownMesh> MeshJob::take() {
    if (cancelled_) return {};
    if (error_) std::rethrow_exception(error_);
    return std::move(mesh_);
}

std::optional<glm::dvec3> point_on_mesh(const TriangleMesh& mesh, const Camera& camera,
                                        double near_plane, const glm::dvec2& px) {
    const glm::dvec3 origin(mesh.origin[0], mesh.origin[1], mesh.origin[2]);
    const glm::dvec3 eye = camera.centre() - origin;
    const glm::dvec3 ray = glm::transpose(camera.rotation) *
                           glm::dvec3((px.x - camera.cx) / camera.fx,
                                      (px.y - camera.cy) / camera.fy, 1);  // 1 along the axis
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& face : mesh.face) {
        const glm::dvec3 a(mesh.position[face[0]]);
        const glm::dvec3 u = glm::dvec3(mesh.position[face[1]]) - a,
                         v = glm::dvec3(mesh.position[face[2]]) - a;
        // Moeller and Trumbore 1997
        const glm::dvec3 p = glm::cross(ray, v), t = eye - a, q = glm::cross(t, u);
        const double det = glm::dot(u, p);
        if (det == 0) continue;
        const double x = glm::dot(t, p) / det, y = glm::dot(ray, q) / det;
        if (x < 0 || y < 0 || x + y > 1) continue;
        const double depth = glm::dot(v, q) / det;
        if (depth >= near_plane && depth < nearest) nearest = depth;
    }
    if (nearest == std::numeric_limits<double>::infinity()) return {};
    return origin + eye + nearest * ray;
}

}  // namespace darb
