// SPDX-License-Identifier: MIT
// SplatPicture: a scene on the device and 8-bit pictures of it, in any display mode. It wraps the
// engine's Forward, which it builds anew when the kernel, the footprint or the needs of a mode
// change.
//
// A picture is either rendered and waited for, or started, and then its outcome is known some
// frames later. Pictures under way take turns with what they share on the device, in the order of
// the queue; what the host writes and reads belongs to each alone (Flight). The host waits for all
// of them before it frees or replaces what they use: for another scene, larger buffers, other
// pipelines.
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
#include "viewer/mesh_picture.h"
#include "viewer/surface_probe.h"

namespace darb {

/// A photo over a part of the frame, for comparison. Position and scale are in px of the full
/// frame.
struct PhotoOverlay {
    const Buffer* photo = nullptr;  // uint [height][width], R in the low byte
    int width = 0, height = 0;      // px
    double x = 0, y = 0, scale = 1;
};

/// The arguments of shaders/view for a frame of this size.
gpu::DisplayArgs display_args(int width, int height, const DisplaySettings& display,
                              const PhotoOverlay& photo);

/// The outcome of a picture that was started.
struct StartedPicture {
    int frame = 0;
    /// False: it had no room, so the previous picture is still seen. There is room now.
    bool whole = true;
    std::string error;  // why there cannot be room, or ""
    gpu::FrameStatus status{};
    std::vector<PassTime> passes;
};

class SplatPicture {
  public:
    explicit SplatPicture(Device& device);

    /// Uploads a scene. The model must stay where it is as long as it is shown. important: the
    /// splats to draw in motion, most important first; may be empty. Throws Error and keeps the
    /// previous scene.
    void set_scene(const SplatModel& model, const Bounds& bounds,
                   std::vector<std::uint32_t> important = {});
    /// Adds a level of the scene's merged splats, which is drawn in motion instead of as many
    /// important ones. It has fewer splats than the levels before it, or as many as one of them,
    /// which it then replaces. Display styles do not use levels. Throws Error.
    void add_level(const SplatModel& level);
    /// To be called when all levels are there; the important splats are then no longer needed.
    void end_levels() { levels_ended_ = true; }
    bool levels_ended() const { return levels_ended_; }
    /// Shows splats that someone else owns and changes (a training run). Display styles that need
    /// the model on the host fall back to splats.
    void set_live(const GpuSplats& splats, const Bounds& bounds);
    /// Lets go of the scene and of a mesh.
    void clear();
    bool empty() const { return splats() == nullptr; }
    std::uint32_t splat_count() const { return splats() ? splats()->count() : 0; }

    /// Hides the splats of the first mask (1), highlights those that are selected (1), and shows
    /// the others as in the model. The levels are dropped. The next picture takes the marks along,
    /// so nothing waits.
    void set_marks(const std::vector<std::uint8_t>& unseen,
                   const std::vector<std::uint8_t>& selected);
    /// Takes over changed values of the model; the number of splats must be the same. Throws Error.
    void update_scene();

    /// Shows a mesh with the scene, where the display asks for one; null: there is none any more.
    /// Throws Error and keeps the previous one.
    void set_mesh(const TriangleMesh* mesh);
    bool has_mesh() const { return mesh_.has_value(); }

    /// The point of the splats' surface in a pixel of the camera's picture, world; nothing where
    /// they leave more than half of the light. It is the median depth of `darb render --depth`, of
    /// the splats as they are, without a lens. Waits. Throws Error.
    std::optional<glm::dvec3> surface_at(const Camera& camera, const DisplaySettings& display,
                                         const glm::dvec2& px);

    /// Renders and waits. camera: at the size of the wanted frame. moving: uses the fast accuracy
    /// settings and this share of the splats, for a picture that is replaced at once. pane:
    /// pictures that take turns keep their own pipelines this way.
    void render(const Camera& camera, const DisplaySettings& display, const PhotoOverlay& photo,
                std::optional<double> moving = {}, int pane = 0);
    /// Does the same as a part of this frame, without waiting; whatever is submitted after it can
    /// show it. It waits all the same where something must be made for it.
    void start(int frame, const Camera& camera, const DisplaySettings& display,
               const PhotoOverlay& photo, std::optional<double> moving = {}, int pane = 0);
    /// Starts a picture in motion that nobody sees.
    void rehearse(int frame, const Camera& camera, const DisplaySettings& display, double moving,
                  int pane = 0);
    /// Waits for the pictures of frames up to this one. Throws DeviceLost.
    void finish(int frame);
    /// The outcomes of those that are done, in order. It does not wait unless one had no room.
    std::vector<StartedPicture> take_done();
    /// Frees what the panes from this number on have kept.
    void keep_panes(std::size_t count);

    /// Whether a picture in motion has all the pipelines and uploads that it needs.
    bool ready_to_move(const DisplaySettings& display, int pane = 0) const;
    /// The largest share below 1 of the splats that render accepts as `moving`.
    double most_moving() const;

    /// The last picture of a pane, B8G8R8A8 [height][width], and its size.
    const Buffer& pixels(int pane = 0) const { return image_of(pane).now; }
    int width(int pane = 0) const { return image_of(pane).size.x; }
    int height(int pane = 0) const { return image_of(pane).size.y; }
    /// Whether the last picture had to build pipelines, which some drivers compile while they run.
    bool compiled() const { return compiled_; }
    /// Counters and pass times of the last picture that was waited for.
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
        bool ellipsoids = false, store = false, depth = false, mesh = false;
        bool operator==(const Key&) const = default;
    };
    struct Slot {
        std::optional<FrameBuffers> buffers;
        std::optional<Forward> forward;
        std::optional<MeshBlend> mesh_blend;  // in place of forward's blend
        Key key;
        int degree = -1;  // the last picture's degree, which has a pipeline of its own
        bool fresh = true;
    };
    struct Image {  // one pane's; the previous one is seen where a frame has no room
        Buffer now, before;
        glm::ivec2 size{0}, size_before{0};  // px
    };
    struct Job {  // a picture, with its source and its settings
        Camera camera, rendered;
        DisplaySettings display;
        PhotoOverlay photo;
        const GpuSplats* splats = nullptr;
        Slot* slot = nullptr;
        Image* image = nullptr;
        Pipeline* pipeline = nullptr;
        MeshShow mesh = MeshShow::none;
    };
    struct Flight {  // what a picture under way has for itself
        explicit Flight(Device& device) : exchange(device), commands(device) {}
        int frame = 0;
        Slot* slot = nullptr;
        bool in_vain = false;  // an earlier one had no room, and so neither has this
        FrameExchange exchange;
        std::vector<Buffer> uploads;
        std::vector<GpuSplats> dropped;  // splats that it still reads
        Commands commands;               // the last member: its destructor waits for them
    };
    Job prepare(const Camera& camera, const DisplaySettings& display, const PhotoOverlay& photo,
                std::optional<double> moving, int pane);
    void prepare_image(Job& job, int image);
    void reserve(const Job& job);
    void record(const Job& job, Flight& flight);
    void record_splats(const Job& job, Flight& flight);
    MeshShow shown_mesh(const DisplaySettings& display) const;
    // Turns the splats' colours into their depths, between the two steps of a frame.
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
    std::optional<MeshPicture> mesh_;
    std::optional<SurfaceProbe> probe_;  // once a point of the surface was asked for
    std::vector<std::uint32_t> important_;
    std::vector<GpuSplats> levels_;  // in falling order of size
    bool levels_ended_ = false;
    // Applies the marks to a copy. splats: which ones were copied; empty means all.
    void apply_marks(const std::vector<std::uint32_t>& splats, SplatModel& copy) const;
    struct {
        std::vector<std::uint8_t> unseen, selected;  // [N], or none
        bool tinted = false;                         // own_ has colours that are not the model's
        std::vector<float> opacity_logit, sh_dc;     // for own_, uploaded with the next picture
    } marks_;
    Bounds bounds_;
    std::map<int, Slot> slots_;      // pane p has 2 p at rest and 2 p + 1 in motion
    std::map<int, Image> images_;    // by pane; kRehearsal for what nobody sees
    std::uint64_t most_pixels_ = 0;  // the largest picture so far
    Buffer nothing_;                 // stands in for a photo or a previous picture
    bool compiled_ = false;
    StartedPicture rendered_;  // the last picture that was waited for
    std::deque<std::unique_ptr<Flight>> under_way_;
    std::vector<std::unique_ptr<Flight>> free_;
    std::vector<StartedPicture> done_;
};

}  // namespace darb
