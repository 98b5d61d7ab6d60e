// SPDX-License-Identifier: MIT
// PictureWork: work that goes on while the window lives. Some draws pictures of its own, one
// picture a frame: the export of a camera path, the measurement of settings and effects, or the
// search for splats in free space. A mesh is read or made by a thread. They may run at a time.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/core/image.h"
#include "engine/core/on_threads.h"
#include "engine/gpu/device.h"
#include "engine/gpu/pipeline.h"
#include "engine/render/free_space.h"
#include "engine/render/renderer.h"
#include "engine/scene/camera.h"
#include "engine/scene/clutter.h"
#include "engine/scene/splat_model.h"
#include "viewer/display.h"
#include "viewer/mesh_work.h"
#include "viewer/path_export.h"
#include "viewer/session.h"
#include "viewer/splat_picture.h"

namespace darb {

class AccuracyMeasure {
  public:
    struct Frame {
        ImageU8 picture;
        double ms = 0;
    };
    /// camera: used for all pictures, which therefore have one size. display: the current one; each
    /// choice replaces one setting of it. own: how the scene is meant to be shown; with the exact
    /// preset it is what errors are measured against.
    AccuracyMeasure(const Camera& camera, const DisplaySettings& display,
                    const DisplaySettings& own);

    bool done() const { return next_ >= pictures_.size(); }
    double share() const { return double(next_) / double(pictures_.size()); }
    void step(const std::function<Frame(const Camera&, const DisplaySettings&)>& render);
    const std::vector<MeasuredChoice>& results() const { return results_; }

  private:
    /// Choices that give the same picture, as all that are chosen now do.
    struct Picture {
        DisplaySettings display;
        std::vector<MeasuredChoice> choices;
    };
    Camera camera_;
    std::vector<Picture> pictures_;  // the exact one first, then the current one
    std::vector<MeasuredChoice> results_;
    size_t next_ = 0;
    ImageF exact_;
};

class FreeSpaceSearch {
  public:
    FreeSpaceSearch(Device& device, const SplatModel& model, const std::vector<Camera>& cameras,
                    const FreeSpaceOptions& options);
    bool done() const { return next_ >= cameras_.size(); }
    double share() const { return double(next_) / double(cameras_.size()); }
    void step() { space_.ask(renderer_, cameras_[next_++]); }
    SplatSet splats() const { return space_.splats(); }

  private:
    std::vector<Camera> cameras_;
    Renderer renderer_;
    FreeSpace space_;
    std::size_t next_ = 0;
};

class PictureWork {
  public:
    /// Ends an earlier export. Throws as PathExport does.
    void start_export(const CameraPath& path, const ExportOptions& options);
    void start_measure(const Camera& camera, const DisplaySettings& display,
                       const DisplaySettings& own);
    /// model: must stay as it is until the search ends. cameras: see evenly_chosen.
    void start_search(Device& device, const SplatModel& model, const std::vector<Camera>& cameras,
                      const FreeSpaceOptions& options);
    /// Ends the reading or making of an earlier mesh. wake: see MeshJob.
    void start_mesh(MeshJob::Work work, std::function<void()> wake);
    void cancel_mesh();
    void cancel();
    /// Ends the work, because the scene that it shows is gone. Returns what there is to say, or "".
    std::string lose_scene(const char* why);

    bool exports() const { return export_.has_value(); }
    bool measures() const { return measure_.has_value(); }
    bool searches() const { return search_ != nullptr; }
    bool meshes() const { return mesh_ != nullptr; }
    /// Whether the next step draws into the picture, or takes the time that one would take.
    bool draws() const { return measures() || searches() || (exports() && !export_->has_frames()); }
    double export_share() const {
        return export_ ? export_->share() : -1;
    }  // negative: there is none
    double measure_share() const { return measure_ ? measure_->share() : -1; }
    double search_share() const { return search_ ? search_->share() : -1; }
    double mesh_share() const { return mesh_ ? mesh_->share() : -1; }
    std::string mesh_stage() const { return mesh_ ? mesh_->stage() : ""; }

    /// Draws one picture of the export. Once all are there, it looks whether the video is done, or
    /// waits for it with `wait`. Returns what was written where that ends the export. A failed
    /// export is over. Throws Error.
    std::optional<std::string> step_export(SplatPicture& picture, bool wait = false);
    /// Returns all that has been measured so far. A failed measurement is over. Throws Error.
    std::vector<MeasuredChoice> step_measure(SplatPicture& picture);
    /// Asks one camera. Returns what was found once all were asked. Throws Error.
    std::optional<SplatSet> step_search();
    /// The mesh, once it is there; wait: waits for it. Throws Error where there is none.
    std::optional<ShownMesh> take_mesh(bool wait = false);

  private:
    std::optional<PathExport> export_;
    std::optional<AccuracyMeasure> measure_;
    std::unique_ptr<FreeSpaceSearch> search_;
    std::unique_ptr<MeshJob> mesh_;
    std::vector<std::unique_ptr<MeshJob>> ended_;  // cancelled ones whose threads still run
};

/// Converts B8G8R8A8 [height][width] to RGB.
ImageU8 read_pixels(const Buffer& pixels, int width, int height);
/// The last rendered picture as RGB.
ImageU8 read_pixels(const SplatPicture& picture);

// WarmUp: compiles what the pictures of a scene need before a window draws the first one, on a
// thread of its own. It first draws on a device of its own: drivers that compile at the first
// dispatch, such as Mesa's, keep the result on disk. Then it makes the same pipelines for the
// window's device, which finds them there.

class WarmUp {
  public:
    /// window: the window's device, which must outlive this. options: for a device like it.
    /// displays: one for each pane. A few splats of the model are drawn, at rest and in motion.
    /// wake: called from the thread at the end. The destructor waits for the picture or pipeline
    /// under way.
    WarmUp(Device& window, DeviceOptions options, const SplatModel& model,
           std::vector<DisplaySettings> displays, const Camera& camera, std::function<void()> wake);
    ~WarmUp() { stop_ = true; }
    /// Whether it is over, even where it failed, as the window then compiles itself.
    bool done() const { return done_; }
    /// Once it is done: the pipelines for the window's device, to be kept until its pictures are
    /// drawn.
    std::vector<Pipeline> take_pipelines() { return std::move(made_); }

  private:
    void run(Device& window, const DeviceOptions& options, const SplatModel& few,
             const std::vector<DisplaySettings>& displays, const Camera& camera);
    std::vector<Pipeline> made_;
    std::atomic<bool> done_{false}, stop_{false};
    JoinedThread thread_;  // the last member
};

}  // namespace darb
