// SplatPicture: a scene on the device and 8-bit pictures of it, in any display mode. It wraps the
// engine's Forward, which it builds anew when kernel, footprint or what a mode needs changes.
#pragma once

#include <map>
#include <optional>
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
    /// others are as in the model. Levels go.
    void set_marks(const std::vector<std::uint8_t>& unseen,
                   const std::vector<std::uint8_t>& selected);
    /// The model's values changed, not their number. Throws Error.
    void update_scene();

    /// Renders and waits. camera: at the size of the frame that is wanted. moving: with the fast
    /// accuracy settings and this share of the splats, for a picture that is replaced at once.
    /// pane: pictures that take turns, each with settings of its own, keep their pipelines so.
    void render(const Camera& camera, const DisplaySettings& display, const PhotoOverlay& photo,
                std::optional<double> moving = {}, int pane = 0);
    /// Frees what panes from this one on have kept.
    void keep_panes(std::size_t count);
    /// The last picture's pixels for a buffer that is as large.
    void take_pixels(Buffer& into) { std::swap(pixels_, into); }

    /// Whether a picture in motion needs nothing that is not there yet: pipelines, uploads.
    bool ready_to_move(const DisplaySettings& display, int pane = 0) const;
    /// Renders in motion; pixels, size and counters stay those of the last render. Returns the
    /// times of the passes.
    std::vector<PassTime> rehearse(const Camera& camera, const DisplaySettings& display,
                                   double moving, int pane = 0);
    /// The largest share below 1 of the splats that render takes as `moving`.
    double most_moving() const;

    /// Of the last render: B8G8R8A8 [height][width], its size, counters, times of the passes.
    const Buffer& pixels() const { return pixels_; }
    int width() const { return size_.x; }
    int height() const { return size_.y; }
    const gpu::FrameStatus& status() const { return status_; }
    /// Whether it had to build pipelines, which some drivers compile while they run.
    bool compiled() const { return compiled_; }
    const std::vector<PassTime>& pass_times() const { return pass_times_; }

  private:
    const GpuSplats* splats() const { return live_ ? live_ : own_ ? &*own_ : nullptr; }
    const GpuSplats& styled(SplatStyle style);
    const GpuSplats& some_styled(SplatStyle style, double share);
    const GpuSplats* level_of(SplatStyle style, double share) const;
    void drop_levels();
    // The splats' colours become their depths, between the two steps of a frame.
    void record_depth_colours(const ProjectedSplats& projected, const Camera& camera,
                              std::uint32_t splats);
    void record_display(const Frame& frame, const Buffer& image, const Camera& camera,
                        const DisplaySettings& display, const PhotoOverlay& photo);

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
    };
    Slot& slot_for(const GpuSplats& splats, const DisplaySettings& display, bool moving, int pane);
    Key key_for(const DisplaySettings& display, bool moving) const;
    static ForwardOptions options_for(const Key& key);

    Device* device_;
    FrameExchange exchange_;
    Commands commands_;
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
    std::vector<std::uint8_t> unseen_, selected_;  // [N], or none
    bool tinted_ = false;                          // colours of own_ are not the model's
    Bounds bounds_;
    std::map<int, Slot> slots_;  // of pane p: 2 p at rest, 2 p + 1 moving
    Buffer pixels_, no_photo_;
    glm::ivec2 size_{0};  // px
    bool compiled_ = false;
    gpu::FrameStatus status_{};
    std::vector<PassTime> pass_times_;
};

}  // namespace darb
