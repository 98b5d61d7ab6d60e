// SPDX-License-Identifier: MIT
// Scene: a splat file in memory, and the job that loads one in the background.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "engine/scene/project_file.h"
#include "engine/scene/splat_model.h"
#include "engine/scene/stored_units.h"
#include "viewer/bounds.h"
#include "viewer/mesh_work.h"

namespace darb {

/// A project as it was read, with its edits performed on the scene's model.
struct OpenedProject {
    Project project;
    Edit edit;
};

struct Scene {
    std::filesystem::path file;
    SplatModel model;
    std::optional<SplatModel> drawn;  // where it is not the model itself: Edit::drawn_otherwise
    std::unique_ptr<OpenedProject> project;  // where the file is one
    Bounds bounds;                           // around nearly all splats
    Subject subject;                         // what the cameras look at
    std::string format;                      // a name from format_name
    bool is_points = false;  // whether it is a point cloud, without splat parameters in the file
    std::optional<ShownMesh> mesh;         // where the file holds one; its vertices are the points
    std::vector<std::uint32_t> important;  // what is drawn in motion, most important first
    std::string up;                        // a value of --up where the file says it; else empty
    double load_s = 0;
    std::vector<std::string> notes;  // what was dropped or cannot be shown, a sentence each

    /// What pictures show.
    const SplatModel& shown() const { return drawn ? *drawn : model; }
};

/// Measures the bounds, the most important splats, and the subject as if there were no cameras.
void measure_scene(Scene& scene);

/// Throws Error where the path is neither a file nor a scene's folder: it does not exist, or is a
/// pipe.
void check_scene_file(const std::filesystem::path& file);

/// Reads a file that load_splats knows, or a PLY point cloud or a mesh, whose points become small
/// opaque splats. A project brings all its layers.
/// `progress` is called with a share of 0 to 1 and what is being done; it throws to cancel. Throws
/// an Error that names the file.
using LoadProgress = std::function<void(double share, const char* stage)>;
Scene load_scene_file(const std::filesystem::path& file, const LoadProgress& progress = {},
                      const StoredUnits& units = {});

/// Loads one file on a thread of its own. Cancelling takes effect at the next report of progress.
class LoadJob {
  public:
    /// wake: called from the thread whenever there is something new to show.
    LoadJob(std::filesystem::path file, std::function<void()> wake, const StoredUnits& units = {});
    ~LoadJob();  // cancels and waits
    LoadJob(const LoadJob&) = delete;
    LoadJob& operator=(const LoadJob&) = delete;

    const std::filesystem::path& file() const { return file_; }
    double share() const { return share_; }
    std::string stage() const;
    void cancel() { cancelled_ = true; }
    bool done() const { return done_; }
    void wait();
    /// After done(): the scene, or nothing where it was cancelled. Throws the Error of loading.
    std::optional<Scene> take();

  private:
    void run();
    std::filesystem::path file_;
    std::function<void()> wake_;
    StoredUnits units_;
    std::atomic<double> share_{0};
    std::atomic<bool> cancelled_{false}, done_{false};
    mutable std::mutex mutex_;  // guards stage_
    std::string stage_;
    std::optional<Scene> scene_;
    std::exception_ptr error_;
    std::thread thread_;
};

// SceneLoader: the one scene that is being loaded in the background, and cancelled earlier loads
// that still run.

struct LoadedScene {
    Scene scene;
    std::filesystem::path asked_for;  // the path before it was resolved to a file
    bool dropped = false;             // dropped on the window, rather than named
    bool merges = false;              // to be added to the current scene
};

class SceneLoader {
  public:
    using Resolve = std::function<std::filesystem::path(const std::filesystem::path&)>;
    /// resolve: maps a path to the file that it means; may be null. wake: called from other threads
    /// when there is something new.
    SceneLoader(Resolve resolve, std::function<void()> wake);

    /// Starts a load and cancels an earlier one. Throws Error where the path means no scene.
    void start(const std::filesystem::path& path, bool dropped, bool merges = false,
               const StoredUnits& units = {});
    void cancel();
    bool loading() const { return job_ != nullptr; }
    double share() const { return job_ ? job_->share() : -1; }  // negative: nothing is loaded
    std::string stage() const;
    /// The scene, once it is there. Throws Error where it could not be loaded.
    std::optional<LoadedScene> poll();
    /// Does the same after waiting for the load.
    std::optional<LoadedScene> wait();

  private:
    Resolve resolve_;
    std::function<void()> wake_;
    std::unique_ptr<LoadJob> job_;
    std::filesystem::path asked_for_;
    bool dropped_ = false, merges_ = false;
    std::vector<std::unique_ptr<LoadJob>> cancelled_;
};

// The splats of a scene that matter most to its pictures. They are drawn while the camera moves.

/// How many splats are kept in this order at most. More would be too slow where all are drawn.
inline constexpr std::size_t kMostMoving = 400'000;

/// Indices of the `count` splats with the largest opacity times area of their two longer axes, most
/// important first. The area is divided by the squared distance to the scene's middle where that is
/// beyond its radius, so that a far background does not take all places. count: at most
/// model.size().
std::vector<std::uint32_t> most_important(const SplatModel& model, const Bounds& bounds,
                                          std::size_t count);

}  // namespace darb
