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

#include "engine/scene/splat_model.h"
#include "engine/scene/stored_units.h"
#include "viewer/bounds.h"

namespace darb {

struct Scene {
    std::filesystem::path file;
    SplatModel model;
    Bounds bounds;                         // of nearly all splats
    Subject subject;                       // what it is looked at for
    std::string format;                    // as format_name says it
    bool is_points = false;                // a point cloud: no splat parameters in the file
    std::vector<std::uint32_t> important;  // what is drawn in motion, most important first
    std::string up;                        // as --up takes it, where the file says it; else empty
    double load_s = 0;
    std::vector<std::string> notes;  // what was dropped or cannot be shown, a sentence each
};

/// Bounds, and what is important of the model; its subject as if it had no cameras.
void measure_scene(Scene& scene);

/// Throws Error where this is neither a file nor a folder of a scene: it is not there, or a pipe.
void check_scene_file(const std::filesystem::path& file);

/// A file that load_splats reads, or a PLY point cloud, which becomes small opaque splats.
/// `progress` is called with 0..1 and what is being done; it throws to cancel. Throws Error naming
/// the file.
using LoadProgress = std::function<void(double share, const char* stage)>;
Scene load_scene_file(const std::filesystem::path& file, const LoadProgress& progress = {},
                      const StoredUnits& units = {});

/// One file on a thread of its own. Cancelling takes effect at the next report of progress.
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
    mutable std::mutex mutex_;  // of stage_
    std::string stage_;
    std::optional<Scene> scene_;
    std::exception_ptr error_;
    std::thread thread_;
};

// SceneLoader: the one scene that is being loaded in the background, and the loads before it that
// were cancelled and still run.

struct LoadedScene {
    Scene scene;
    std::filesystem::path asked_for;  // before it was resolved to a file
    bool dropped = false;             // on the window, rather than named
    bool merges = false;              // into the scene that is there
};

class SceneLoader {
  public:
    using Resolve = std::function<std::filesystem::path(const std::filesystem::path&)>;
    /// resolve: the file that a path means, may be none. wake: called from other threads when there
    /// is something new.
    SceneLoader(Resolve resolve, std::function<void()> wake);

    /// An earlier load is cancelled. Throws Error where the path means no scene.
    void start(const std::filesystem::path& path, bool dropped, bool merges = false,
               const StoredUnits& units = {});
    void cancel();
    bool loading() const { return job_ != nullptr; }
    double share() const { return job_ ? job_->share() : -1; }  // below 0: nothing is loaded
    std::string stage() const;
    /// The scene, once it is there. Throws Error where it could not be loaded.
    std::optional<LoadedScene> poll();
    /// The same after waiting for it.
    std::optional<LoadedScene> wait();

  private:
    Resolve resolve_;
    std::function<void()> wake_;
    std::unique_ptr<LoadJob> job_;
    std::filesystem::path asked_for_;
    bool dropped_ = false, merges_ = false;
    std::vector<std::unique_ptr<LoadJob>> cancelled_;
};

// Which splats of a scene matter most to its pictures: what is drawn while the camera moves.

/// The most splats that are kept in this order; more are too slow for motion where all are.
inline constexpr std::size_t kMostMoving = 400'000;

/// Indices of the `count` splats with the largest opacity times area of their two longer axes, most
/// important first; the area is divided by the squared distance to the scene's middle where that is
/// beyond its radius, so that a far background does not take all. count: at most model.size().
std::vector<std::uint32_t> most_important(const SplatModel& model, const Bounds& bounds,
                                          std::size_t count);

}  // namespace darb
