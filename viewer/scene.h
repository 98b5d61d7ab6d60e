// Scene: a splat file in memory, and the job that loads one in the background.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
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

}  // namespace darb
