// SPDX-License-Identifier: MIT
// Painter: how it is painted. Pictures of the scene, whole ones and those in motion, the panels
// over them, and the canvas that takes both; what it needs of the device, and when it draws.
//
// Two frames are under way at a time. A frame starts its picture, and what it took, which decides
// how good the next ones are, is known one or two frames later.
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
    /// Called from other threads when there is something to show.
    std::function<void()> wake;
    /// Of a device like this one, to compile on while the last picture of a run is shown.
    std::optional<DeviceOptions> second_device;
};

/// What paint needs to know of a frame.
struct PaintedFrame {
    int width = 0, height = 0;  // px
    bool full = false;          // the whole picture at once, no lesser one in motion
    bool of_run = false;        // its pictures are shown, not the scene's
};

/// The last picture of a run. Frames under way may still read those before it.
struct LivePixels {
    std::array<Buffer, kFramesUnderWay + 1> buffers;
    std::size_t at = 0;
    bool composed = false;  // a frame has taken it
    glm::ivec2 size{0};     // px

    void set(Device& device, const LiveMade& made);
};

class Painter {
  public:
    /// window: null without one.
    Painter(Device& device, Session& session, PainterOptions options, GLFWwindow* window);
    ~Painter();
    Painter(const Painter&) = delete;
    Painter& operator=(const Painter&) = delete;

    /// Another scene's splats; the scene stays where it is as long as it is shown. Where it throws,
    /// those before are still there.
    void open(const Scene& scene);
    /// After `open`, once the session has the scene. of_run: the last picture of a run is shown,
    /// and stays until pictures of the scene have nothing to compile.
    void begin_scene(bool of_run);
    /// Edits are seen: other splats are deleted, selected or moved now. Throws Error.
    void show_edits();
    /// A run is shown from now on, by the pictures that it makes.
    void begin_run();
    void show_picture_of_run(const LiveMade& made);

    /// Starts a frame, the panels' as well: waits for the one before the last, and takes what
    /// became of the pictures that are done. Throws DeviceLost.
    void begin(int width, int height);
    Gui& gui() { return gui_; }
    /// The picture where something it depends on changed.
    void paint(const PaintedFrame& frame);
    /// Records the canvas's commands: the picture, the panels over it. The caller runs them.
    void compose();
    /// The canvas was shown: the whole frame's time is known.
    void presented();
    /// Seconds until a frame is wanted for the picture's sake; infinity where none is.
    double seconds_to_next();

    /// Frames for the panels alone, which show something new.
    void unsettle() { pacing_.unsettle(); }
    /// Panels have found their size and show the picture's times.
    bool settled() const { return pacing_.settled(); }
    /// The picture is to be drawn again.
    void forget() { pacing_.forget(); }
    /// It has all pixels, and the most important splats at least.
    bool refined() const;
    /// It is whole, and one in motion would have nothing to wait for.
    bool at_rest() const;
    /// No levels of merged splats for motion are being made.
    bool levels_ready() const { return picture_.levels_ended() || !levels_; }

    /// What is seen, without panels and highlights. of_run: of the run that is shown; null where
    /// there is no picture yet. Waits.
    std::optional<ImageU8> picture_alone(int width, int height, bool of_run);
    /// Exports and measurements, which draw pictures of their own. Throws Error.
    void start_export();
    void start_measure(int width, int height);
    void cancel_work() { work_.cancel(); }
    bool draws_work() const { return work_.draws(); }
    bool exports() const { return work_.exports(); }
    /// A step of an export; wait: for the video, too. Throws Error.
    void step_export(bool wait);

    Canvas& canvas() { return canvas_; }
    const SplatPicture& picture() const { return picture_; }

  private:
    using Clock = std::chrono::steady_clock;
    struct Started {  // pictures of a frame, of which it is not known yet what became of them
        int frame = 0;
        PictureStep step = PictureStep::none;
        MotionQuality quality;
        bool refines = false;      // the picture before it had fewer pixels
        bool counts = true;        // its time says something: it built nothing
        std::size_t pictures = 1;  // that are not done
        StartedPicture made;       // of those that are
        Clock::time_point begun{};
        double frame_ms = 0;  // of the frame; 0: it was not shown
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
    std::vector<DisplaySettings> shown_displays() const;  // a pane each
    PaneWish wish_for(const Camera& camera, const WindowArea& area,
                      std::optional<double> moving) const;
    void fit_panes();
    bool ready_to_move() const;
    BufferPicture shown() const;
    BufferPicture drawn() const;  // of the scene, while the run's last picture is still shown too
    void draw_picture(const PictureKey& key, PictureStep step, bool wait);
    bool make_picture(const PaneWish& wish, Started& started, bool wait);
    void rehearse_motion(const PictureKey& key);
    void step_work();
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
    bool shows_panes_ = false;  // not picture_
    LivePixels live_;
    PicturePacing pacing_;
    int frame_ = 0;                  // number of this one
    std::deque<Started> under_way_;  // by their frames
    bool copies_wanted_ = false;     // of the panes' pictures, with this frame
    int psnr_at_ = 0;                // the frame in which they are there; 0: none are made
    int rehearsals_ = 0;             // of motion, still to come
    double besides_picture_ms_ = 0;  // what a frame took beside its picture, before them
    PictureWork work_;
    int shown_model_ = 0, shown_edit_ = 0;  // Edit::model_version, seen_version of the picture
    std::vector<double> shares_;            // of the splats in motion, below all
    std::unique_ptr<MotionLevels> levels_;  // of the scene; null: none asked for
    std::vector<std::unique_ptr<MotionLevels>> ended_;  // cancelled, their threads still run
    std::unique_ptr<WarmUp> warm_up_;                   // the run's last picture is shown
    std::vector<Pipeline> warm_pipelines_;              // that it made, until pictures have them
    int version_ = 0;                                   // of the scene and its edits
    bool highlights_ = true;                            // what is selected, in the picture
    Clock::time_point frame_start_;
};

}  // namespace darb
