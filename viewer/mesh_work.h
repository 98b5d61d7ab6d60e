// SPDX-License-Identifier: MIT
// The mesh that a viewer shows: which files hold one, the thread that reads or makes one while the
// window lives, and where a ray meets it.
#pragma once

#include <atomic>
#include <cstddef>
#include <exception>
#include <filesystem>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/core/on_threads.h"
#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/mesh/depth_views.h"
#include "engine/mesh/triangle_mesh.h"
#include "engine/scene/camera.h"
#include "engine/scene/splat_model.h"

namespace darb {

struct ShownMesh {
    TriangleMesh mesh;
    std::filesystem::path file;      // where it is; empty: it was made and is not saved
    std::vector<std::string> notes;  // what was left out, a sentence each
};

/// Whether the content is a mesh of triangles rather than splats or points: a PLY with faces, an
/// .obj, or a glTF without splats. head: the beginning of the file, all of it where it is a .gltf.
bool holds_mesh(std::span<const std::byte> head, const std::filesystem::path& name);
/// The same, for a file that may be missing or anything else: then false.
bool is_mesh_file(const std::filesystem::path& file);
/// Throws Error where the file is missing, or holds no mesh by is_mesh_file.
void check_mesh_file(const std::filesystem::path& file);

/// Makes what is shown of a mesh that was parsed. Throws Error where it has no faces.
ShownMesh shown_mesh_of(TriangleMesh mesh, const std::filesystem::path& file,
                        std::vector<std::string> notes);
ShownMesh read_shown_mesh(const std::filesystem::path& file, const MeshProgress& progress = {});

/// How a mesh of the scene is made; the rest as `darb mesh` does it.
struct MeshWish {
    float voxel = 0;      // side, world units; 0: by the size of pixels
    int faces = 0;        // simplify to so many; 0: off
    bool thin = false;    // --method opacity
    bool around = false;  // by cameras around the scene, where it has some of its own
};
/// views: the cameras of the photos; where there are none, or the wish says so, cameras around the
/// scene see it. Works on a device of its own. Throws Error, and what progress throws.
ShownMesh make_shown_mesh(const DeviceOptions& device, const Tuning& tuning, SplatModel model,
                          std::vector<View> views, const MeshWish& wish,
                          const MeshProgress& progress);

/// Reads or makes a mesh on a thread of its own. Cancelling takes effect at the next report of
/// progress.
class MeshJob {
  public:
    using Work = std::function<ShownMesh(const MeshProgress&)>;
    /// wake: called from the thread whenever there is something new to show.
    MeshJob(Work work, std::function<void()> wake);
    ~MeshJob() { cancel(); }  // and waits
    MeshJob(const MeshJob&) = delete;
    MeshJob& operator=(const MeshJob&) = delete;

    std::string stage() const;
    double share() const { return share_; }
    void cancel() { cancelled_ = true; }
    bool done() const { return done_; }
    void wait() { thread_.reset(); }
    /// After done(): the mesh, or nothing where the work was cancelled. Throws its Error.
    std::optional<ShownMesh> take();

  private:
    void run();
    Work work_;
    std::function<void()> wake_;
    std::atomic<double> share_{0};
    std::atomic<bool> cancelled_{false}, done_{false};
    mutable std::mutex mutex_;  // guards stage_
    std::string stage_ = "starting";
    std::optional<ShownMesh> mesh_;
    std::exception_ptr error_;
    std::optional<JoinedThread> thread_;  // the last member
};

/// The nearest point of the mesh on the ray through a pixel, px, of a pinhole's picture, world.
/// What is nearer than near_plane, along the optical axis, does not count. O(faces).
std::optional<glm::dvec3> point_on_mesh(const TriangleMesh& mesh, const Camera& camera,
                                        double near_plane, const glm::dvec2& px);

}  // namespace darb
