// SPDX-License-Identifier: MIT
// Painter: how the session is painted. It makes the pictures of the scene, whole ones and those in
// motion, draws the panels over them, and owns the canvas that takes both. It decides when to draw
// and what it needs of the device.
//
// Two frames are under way at a time. A frame starts its picture, and the time that the picture
// took, which decides how good the next ones are, is known one or two frames later.
#pragma once

#include <array>
#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viewer/canvas.h"
#include "viewer/gui.h"
#include "viewer/live_picture.h"
#include "viewer/pane_pictures.h"
#include "viewer/picture_pacing.h"
#include "viewer/picture_work.h"
#include "viewer/session.h"
#include "viewer/splat_picture.h"

namespace darb {

struct PainterOptions {
    float gui_scale = 1;
    /// Called from other threads when there is something new to show.
    std::function<void()> wake;
    /// A device like this one, which compiles while the last picture of a run is shown, and makes
    /// meshes.
    std::optional<DeviceOptions> second_device;
};

/// What paint needs to know of a frame.
struct PaintedFrame {
    int width = 0, height = 0;  // px
    bool full = false;          // draws the whole picture at once, without a lesser one in motion
    bool of_run = false;        // shows the run's pictures instead of the scene's
};

/// The last picture of a run. Frames under way may still read earlier ones.
struct LivePixels {
    std::array<Buffer, kFramesUnderWay + 1> buffers;
    std::size_t at = 0;
    bool composed = false;  // a frame has taken it
    glm::ivec2 size{0};     // px

    void set(Device& device, const LiveMade& made);
};

class Painter {
  public:
    /// window: null for none.
    Painter(Device& device, Session& session, PainterOptions options, GLFWwindow* window);
    ~Painter();
    Painter(const Painter&) = delete;
    Painter& operator=(const Painter&) = delete;

    /// Uploads another scene, which must stay where it is as long as it is shown. Where this
    /// throws, the previous splats are still there.
    void open(const Scene& scene);
    /// Called after `open`, once the session has the scene. of_run: the last picture of a run is
    /// shown and stays until pictures of the scene have nothing left to compile.
    void begin_scene(bool of_run);
    /// Shows edits: other splats are deleted, selected or moved now. Throws Error.
    void show_edits();
    /// Shows a mesh with the scene: alone, or as the display says, where that asks for none among
    /// the splats. Throws Error and keeps the previous one.
    void show_mesh(ShownMesh mesh, bool alone = false);
    void close_mesh();
    /// Reads a mesh or makes one of the scene on a thread, and shows it.
    void start_mesh(MeshJob::Work work) { work_.start_mesh(std::move(work), options_.wake); }
    void start_mesh_of_scene();
    /// Waits for the mesh that is being read or made. Throws its Error.
    void finish_mesh();
    /// The point of the splats' surface in a pixel of the window; see SplatPicture.
    std::optional<glm::dvec3> surface_at(const Camera& camera, const glm::dvec2& px) {
        return picture_.surface_at(camera, session_->display, px);
    }
    /// From now on shows the pictures that a run makes.
    void begin_run();
    void show_picture_of_run(const LiveMade& made);

    /// Starts a frame, the panels' as well. Waits for the frame before the last and takes the
    /// results of the pictures that are done. Throws DeviceLost.
    void begin(int width, int height);
    Gui& gui() { return gui_; }
    /// Draws the picture where something that it depends on has changed.
    void paint(const PaintedFrame& frame);
    /// Records the canvas's commands: the picture with the panels over it. The caller runs them.
    void compose();
    /// To be called when the canvas was shown and the whole frame's time is known.
    void presented();
    /// Seconds until the picture needs a frame; infinity where it needs none.
    double seconds_to_next();

    /// Asks for frames for the panels alone, because they show something new.
    void unsettle() { pacing_.unsettle(); }
    /// Whether the panels have found their size and show the picture's times.
    bool settled() const { return pacing_.settled(); }
    /// Makes the next frame draw the picture again.
    void forget() { pacing_.forget(); }
    /// Whether the picture has all pixels, and at least the most important splats.
    bool refined() const;
    /// Whether the picture is whole and one in motion would not have to wait for anything.
    bool at_rest() const;
    /// Whether no levels of merged splats for motion are still being made.
    bool levels_ready() const { return picture_.levels_ended() || !levels_; }

    /// What is seen, without panels and highlights. of_run: takes the picture of the run that is
    /// shown; null where there is none yet. Waits.
    std::optional<ImageU8> picture_alone(int width, int height, bool of_run);
    /// Exports, measurements and searches draw pictures of their own. Throws Error.
    void start_export();
    void start_measure(int width, int height);
    void start_search(int least_views);
    void cancel_work() { work_.cancel(); }
    bool draws_work() const { return work_.draws(); }
    bool exports() const { return work_.exports(); }
    /// Whether a mesh is being read or made.
    bool meshes() const { return work_.meshes(); }
    /// Does a step of an export; wait: waits for the video, too. Throws Error.
    void step_export(bool wait);

    Canvas& canvas() { return canvas_; }
    const SplatPicture& picture() const { return picture_; }

  private:
    using Clock = std::chrono::steady_clock;
    struct Started {  // pictures of a frame whose outcome is not known yet
        int frame = 0;
        PictureStep step = PictureStep::none;
        MotionQuality quality;
        bool refines = false;      // the picture before it had fewer pixels
        bool counts = true;        // whether its time counts: nothing was built for it
        std::size_t pictures = 1;  // how many are not done
        StartedPicture made;       // the result of those that are
        Clock::time_point begun{};
        double frame_ms = 0;  // time of the frame; 0: it was not shown
    };
    void take_results();
    void take_result(const Started& started);
    void note_picture(const Started& started, double ms);
    void take_psnr();
    void lose_scene(const char* why);
    void begin_motion();
    void end_warm_up();
    void show_marks(bool highlight);
    void load_current_photo();
    void pace_picture(const PaintedFrame& frame, bool works);
    std::vector<DisplaySettings> shown_displays() const;  // one for each pane
    PaneWish wish_for(const Camera& camera, const WindowArea& area,
                      std::optional<double> moving) const;
    void fit_panes();
    bool ready_to_move() const;
    BufferPicture shown() const;
    BufferPicture drawn() const;  // the scene's, even while the run's last picture is shown
    void draw_picture(const PictureKey& key, PictureStep step, bool wait);
    bool make_picture(const PaneWish& wish, Started& started, bool wait);
    void rehearse_motion(const PictureKey& key);
    void step_work();
    void step_search();
    void take_mesh(bool wait);
    void note_mesh();
    void start_levels();
    void take_levels();
    void lose_levels();

    Device* device_;
    Session* session_;
    PainterOptions options_;
    Canvas canvas_;
    Gui gui_;
    SplatPicture picture_;
    PanePictures panes_;
    bool shows_panes_ = false;  // shows the panes rather than picture_
    LivePixels live_;
    PicturePacing pacing_;
    int frame_ = 0;                  // number of this one
    std::deque<Started> under_way_;  // in the order of their frames
    struct PaneCopies {              // of the panes' pictures, to compare them
        bool wanted = false;         // copy with this frame
        int at = 0;                  // the frame in which the copies are there; 0: none are made
    } copies_;
    int rehearsals_ = 0;             // rehearsals of motion that are still to come
    double besides_picture_ms_ = 0;  // what an earlier frame took beside its picture
    PictureWork work_;
    int shown_model_ = 0, shown_edit_ = 0;  // Edit::model_version and seen_version of the picture
    std::vector<double> shares_;            // shares of the splats for motion, all below 1
    std::unique_ptr<MotionLevels> levels_;  // null: none asked for
    std::vector<std::unique_ptr<MotionLevels>> ended_;  // cancelled ones whose threads still run
    struct Warming {                                    // while the run's last picture is shown
        std::unique_ptr<WarmUp> thread;                 // null: it is over
        std::vector<Pipeline> pipelines;                // made by it, kept until pictures have them
    } warm_up_;
    int version_ = 0;         // counts changes of the scene and its edits
    bool highlights_ = true;  // whether the picture highlights the selection
    Clock::time_point frame_start_;
};

}  // namespace darb
