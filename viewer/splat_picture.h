// SPDX-License-Identifier: MIT
// SplatPicture: a scene on the device and 8-bit pictures of it, in any display mode. It wraps the
// engine's Forward, which it builds anew when kernel, footprint or what a mode needs changes.
//
// A picture is rendered and waited for, or started, and then what became of it is known some frames
// later. What pictures under way share on the device is theirs in turn, as the queue has one order;
// what the host writes and reads belongs to each alone (Flight). The host waits for all of them
// before it frees or makes anew what they use: another scene, larger buffers, other pipelines.
#pragma once

#include <array>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/core/image.h"
#include "engine/raster/forward.h"
#include "engine/raster/frame_buffers.h"
#include "engine/render/renderer.h"
#include "viewer/bounds.h"
#include "viewer/display.h"

namespace darb {

/// A photo over a part of the frame, for comparison. Position and scale in px of the full frame.
struct PhotoOverlay {
    const Buffer* photo = nullptr;  // uint [height][width], R in the low byte
    int width = 0, height = 0;      // px
    double x = 0, y = 0, scale = 1;
};

/// What shaders/view take of a frame of this size.
gpu::DisplayArgs display_args(int width, int height, const DisplaySettings& display,
                              const PhotoOverlay& photo);

/// What became of a picture that was started.
struct StartedPicture {
    int frame = 0;
    /// False: it had no room, and the picture before it is still seen. There is room now.
    bool whole = true;
    std::string error;  // why there cannot be room, or ""
    gpu::FrameStatus status{};
    std::vector<PassTime> passes;
};

class SplatPicture {
  public:
    explicit SplatPicture(Device& device);

    /// Uploads a scene; the model must stay where it is as long as it is shown. Throws Error and
    /// keeps the scene before.
    /// important: what to draw in motion, most important first; may be none.
    void set_scene(const SplatModel& model, const Bounds& bounds,
                   std::vector<std::uint32_t> important = {});
    /// A level of the scene's merged splats, fewer than those before it, or as many as one of them,
    /// in whose place it comes; in motion it is drawn
    /// instead of so many important ones. Not for display styles. Throws Error.
    void add_level(const SplatModel& level);
    /// All levels are there: the important splats are not needed any more.
    void end_levels() { levels_ended_ = true; }
    bool levels_ended() const { return levels_ended_; }
    /// Shows splats that someone else owns and changes (a training run); display styles that
    /// need the model on the host fall back to splats.
    void set_live(const GpuSplats& splats, const Bounds& bounds);
    void clear();
    bool empty() const { return splats() == nullptr; }
    std::uint32_t splat_count() const { return splats() ? splats()->count() : 0; }

    /// Splats that are not to be seen (1) vanish, those that are selected (1) are highlighted, the
    /// others are as in the model. Levels go. The next picture takes them along: nothing waits.
    void set_marks(const std::vector<std::uint8_t>& unseen,
                   const std::vector<std::uint8_t>& selected);
    /// The model's values changed, not their number. Throws Error.
    void update_scene();

    /// Renders and waits. camera: at the size of the frame that is wanted. moving: with the fast
    /// accuracy settings and this share of the splats, for a picture that is replaced at once.
    /// pane: pictures that take turns, each with settings of its own, keep their pipelines so.
    void render(const Camera& camera, const DisplaySettings& display, const PhotoOverlay& photo,
                std::optional<double> moving = {}, int pane = 0);
    /// The same as part of this frame, without waiting: it can be shown by what is submitted after
    /// it. Waits all the same where something must be made for it.
    void start(int frame, const Camera& camera, const DisplaySettings& display,
               const PhotoOverlay& photo, std::optional<double> moving = {}, int pane = 0);
    /// Starts one in motion whose pixels nobody sees.
    void rehearse(int frame, const Camera& camera, const DisplaySettings& display, double moving,
                  int pane = 0);
    /// Waits for pictures of frames up to this one. Throws DeviceLost.
    void finish(int frame);
    /// What became of those that are done, in their order. Does not wait, but where one had no
    /// room.
    std::vector<StartedPicture> take_done();
    /// Frees what panes from this one on have kept.
    void keep_panes(std::size_t count);

    /// Whether a picture in motion needs nothing that is not there yet: pipelines, uploads.
    bool ready_to_move(const DisplaySettings& display, int pane = 0) const;
    /// The largest share below 1 of the splats that render takes as `moving`.
    double most_moving() const;

    /// Of the last picture of a pane: B8G8R8A8 [height][width], and its size.
    const Buffer& pixels(int pane = 0) const { return image_of(pane).now; }
    int width(int pane = 0) const { return image_of(pane).size.x; }
    int height(int pane = 0) const { return image_of(pane).size.y; }
    /// Whether the last picture had to build pipelines, which some drivers compile while they run.
    bool compiled() const { return compiled_; }
    /// Of the last one that was waited for: counters, times of the passes.
    const gpu::FrameStatus& status() const { return rendered_.status; }
    const std::vector<PassTime>& pass_times() const { return rendered_.passes; }

  private:
    const GpuSplats* splats() const { return live_ ? live_ : own_ ? &*own_ : nullptr; }
    const GpuSplats& styled(SplatStyle style);
    const GpuSplats& some_styled(SplatStyle style, double share);
    const GpuSplats* level_of(SplatStyle style, double share) const;
    void drop_levels();

    struct Key {  // what a Forward is built for
        int kernel = -1, sh_stored = 0;
        Footprint footprint = Footprint::psi;
        Accuracy accuracy;
        ProjectionEffects effects;
        HugeSplatPath huge_splat_path = HugeSplatPath::by_counters;
        bool ellipsoids = false, store = false, depth = false;
        bool operator==(const Key&) const = default;
    };
    struct Slot {
        std::optional<FrameBuffers> buffers;
        std::optional<Forward> forward;
        Key key;
        int degree = -1;  // of the last picture: it has a pipeline of its own
        bool fresh = true;
    };
    struct Image {  // of a pane; the one before is seen where a frame has no room
        Buffer now, before;
        glm::ivec2 size{0}, size_before{0};  // px
    };
    struct Job {  // a picture, with what it is made from and of
        Camera camera, rendered;
        DisplaySettings display;
        PhotoOverlay photo;
        const GpuSplats* splats = nullptr;
        Slot* slot = nullptr;
        Image* image = nullptr;
        Pipeline* pipeline = nullptr;
    };
    struct Flight {  // what a picture under way has for itself
        explicit Flight(Device& device) : exchange(device), commands(device) {}
        int frame = 0;
        Slot* slot = nullptr;
        bool in_vain = false;  // an earlier one had no room, and this one neither
        FrameExchange exchange;
        std::vector<Buffer> uploads;
        std::vector<GpuSplats> dropped;  // that it still reads
        Commands commands;               // the last member: its end waits for them
    };
    Job prepare(const Camera& camera, const DisplaySettings& display, const PhotoOverlay& photo,
                std::optional<double> moving, int pane);
    void prepare_image(Job& job, int image);
    void reserve(const Job& job);
    void record(const Job& job, Flight& flight);
    // The splats' colours become their depths, between the two steps of a frame.
    void record_depth_colours(const Job& job, Commands& commands);
    void record_display(const Job& job, const Buffer& image, Commands& commands);
    void record_uploads(Flight& flight);
    void give(int frame, const Job& job);
    void render(const Job& job);
    std::unique_ptr<Flight> free_flight();
    void land();
    bool make_room(Flight& flight, const gpu::FrameStatus& status);
    void settle();
    void drop(GpuSplats splats);
    const Image& image_of(int pane) const;
    Slot& slot_for(const GpuSplats& splats, const DisplaySettings& display, bool moving, int pane);
    Key key_for(const DisplaySettings& display, bool moving) const;
    static ForwardOptions options_for(const Key& key);

    Device* device_;
    Pipeline depth_light_;
    std::optional<Upsample> upsample_;  // made where a picture is rendered at half the size
    std::map<int, Pipeline> display_pipelines_;  // by mode * 2 + whether there is a photo
    const SplatModel* model_ = nullptr;
    const GpuSplats* live_ = nullptr;
    std::optional<GpuSplats> own_, styled_, some_;  // all; all in a style; the important ones
    SplatStyle styled_as_ = SplatStyle::splats, some_as_ = SplatStyle::splats;
    std::vector<std::uint32_t> important_;
    std::vector<GpuSplats> levels_;  // fewer and fewer
    bool levels_ended_ = false;
    // Changes what is marked of a copy; splats: whose, all where there are none.
    void apply_marks(const std::vector<std::uint32_t>& splats, SplatModel& copy) const;
    struct {
        std::vector<std::uint8_t> unseen, selected;  // [N], or none
        bool tinted = false;                         // colours of own_ are not the model's
        std::vector<float> opacity_logit, sh_dc;     // for own_, with the next picture
    } marks_;
    Bounds bounds_;
    std::map<int, Slot> slots_;      // of pane p: 2 p at rest, 2 p + 1 moving
    std::map<int, Image> images_;    // by pane, kRehearsal for what nobody sees
    std::uint64_t most_pixels_ = 0;  // of a picture until now
    Buffer nothing_;                 // in the place of a photo, of a picture before
    bool compiled_ = false;
    StartedPicture rendered_;  // the last one that was waited for
    std::deque<std::unique_ptr<Flight>> under_way_;
    std::vector<std::unique_ptr<Flight>> free_;
    std::vector<StartedPicture> done_;
};

}  // namespace darb
