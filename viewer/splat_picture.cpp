#include "viewer/splat_picture.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "engine/core/error.h"
#include "engine/primitives/groups.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_shapes.h"

namespace darb {

namespace {

constexpr float kRemovedLogit = -100;  // clamped to -30: far below any cut-off
constexpr float kOpaqueLogit = 8;
constexpr float kTransparentLogit = -2.2f;  // an opacity of a tenth
// Orange, (colour - 0.5) / 0.2821 of each channel, over what is selected.
constexpr float kHighlightDc[3] = {1.77f, 0.71f, -1.6f};
constexpr float kHighlightShare = 0.65f;
// Ellipsoids: cut where alpha falls below 0.9. A Gaussian is there at sqrt(2 ln(1/0.9)) = 0.459
// standard deviations, so they are drawn 2 / 0.459 times as large.
constexpr float kEllipsoidCutoff = 0.9f;
constexpr float kEllipsoidGrowth = 1.472f;  // ln(2 / 0.459)
constexpr float kPointLogScale = -20;       // leaves the low-pass: a dot of about two pixels

// Without harmonics where it is no copy.
SplatModel in_style(const SplatModel& own, SplatStyle style) {
    if (style == SplatStyle::splats) return own;
    SplatModel model = pick_splats(own, {});
    limit_sh_degree(0, model);
    model.position = own.position;
    model.rotation = own.rotation;
    model.sh_dc = own.sh_dc;
    model.log_scale = own.log_scale;
    for (float& s : model.log_scale)
        s = style == SplatStyle::points ? kPointLogScale : s + kEllipsoidGrowth;
    model.opacity_logit.assign(own.size(), kOpaqueLogit);
    if (style == SplatStyle::ellipsoids) {  // what is nearly transparent would hide the rest
        for (size_t i = 0; i < model.size(); ++i)
            if (own.opacity_logit[i] < kTransparentLogit) model.opacity_logit[i] = kRemovedLogit;
        set_kernel(model, KERNEL_GAUSSIAN);
    } else {
        model.shape = own.shape;
    }
    return model;
}

}  // namespace

SplatPicture::SplatPicture(Device& device)
    : device_(&device),
      exchange_(device),
      commands_(device),
      depth_light_(device, "view_depth", {{"THREADS", VIEW_GROUP}}),
      no_photo_(device, "no photo", 4) {}

void SplatPicture::set_scene(const SplatModel& model, const Bounds& bounds,
                             std::vector<std::uint32_t> important) {
    if (const std::uint32_t most = GpuSplats::max_count(*device_, model.sh_degree, false);
        model.size() > most)
        throw Error(
            "the scene",
            fmt::format("has {} splats, {} can hold {}", model.size(), device_->info().name, most),
            "Choose another device (darb devices), or prune the scene.");
    own_ = GpuSplats(*device_, model, false);
    styled_.reset();
    some_.reset();
    drop_levels();
    live_ = nullptr;
    model_ = &model;
    bounds_ = bounds;
    unseen_.clear();
    selected_.clear();
    tinted_ = false;
    important_ = std::move(important);
}

void SplatPicture::set_live(const GpuSplats& splats, const Bounds& bounds) {
    clear();
    live_ = &splats;
    bounds_ = bounds;
}

void SplatPicture::clear() {
    own_.reset();
    styled_.reset();
    some_.reset();
    drop_levels();
    important_.clear();
    slots_.clear();
    live_ = nullptr;
    model_ = nullptr;
}

void SplatPicture::set_marks(const std::vector<std::uint8_t>& unseen,
                             const std::vector<std::uint8_t>& selected) {
    if (!own_) return;
    unseen_ = unseen;
    selected_ = selected;
    SplatModel marked;
    marked.opacity_logit = model_->opacity_logit;
    const bool tints = std::find(selected.begin(), selected.end(), 1) != selected.end();
    if (tints || tinted_) marked.sh_dc = model_->sh_dc;
    apply_marks({}, marked);
    if (!marked.opacity_logit.empty()) {
        own_->parameters(kOpacityLogit).upload(marked.opacity_logit);
        if (!marked.sh_dc.empty()) own_->parameters(kShDc).upload(marked.sh_dc);
    }
    tinted_ = tints;
    styled_.reset();
    some_.reset();
    drop_levels();
}

void SplatPicture::apply_marks(const std::vector<std::uint32_t>& splats, SplatModel& copy) const {
    const size_t count = copy.opacity_logit.size();
    for (size_t i = 0; i < count; ++i) {
        const size_t of = splats.empty() ? i : splats[i];
        if (of < unseen_.size() && unseen_[of] != 0) copy.opacity_logit[i] = kRemovedLogit;
        if (of >= selected_.size() || selected_[of] == 0 || copy.sh_dc.empty()) continue;
        for (size_t c = 0; c < 3; ++c)
            copy.sh_dc[3 * i + c] =
                glm::mix(copy.sh_dc[3 * i + c], kHighlightDc[c], kHighlightShare);
    }
}

void SplatPicture::update_scene() {
    if (!own_) return;
    own_ = GpuSplats(*device_, *model_, false);
    tinted_ = false;
    styled_.reset();
    some_.reset();
    drop_levels();
}

void SplatPicture::add_level(const SplatModel& level) {
    const auto same = std::find_if(levels_.begin(), levels_.end(),
                                   [&](const GpuSplats& l) { return l.count() == level.size(); });
    if (same != levels_.end())
        *same = GpuSplats(*device_, level, false);
    else
        levels_.emplace_back(*device_, level, false);
}

void SplatPicture::drop_levels() {
    levels_.clear();
    levels_ended_ = false;
}

// The largest that is not more than asked for.
const GpuSplats* SplatPicture::level_of(SplatStyle style, double share) const {
    if (style != SplatStyle::splats || !own_) return nullptr;
    const double most = share * static_cast<double>(own_->count()) + 1;
    for (const GpuSplats& level : levels_)
        if (level.count() <= most) return &level;
    return nullptr;
}

const GpuSplats& SplatPicture::styled(SplatStyle style) {
    if (style == SplatStyle::splats || !own_) return *splats();
    if (styled_ && styled_as_ == style) return *styled_;
    SplatModel model = in_style(*model_, style);
    apply_marks({}, model);
    styled_.reset();
    styled_.emplace(*device_, model, false);
    styled_as_ = style;
    return *styled_;
}

// A level where there is one; else the beginning of a copy in the order of importance.
const GpuSplats& SplatPicture::some_styled(SplatStyle style, double share) {
    if (share >= 1 || important_.empty() || !own_) return styled(style);
    if (const GpuSplats* level = level_of(style, share)) return *level;
    if (!some_ || some_as_ != style) {
        SplatModel model = in_style(pick_splats(*model_, important_), style);
        apply_marks(important_, model);
        compiled_ = true;
        some_.reset();
        some_.emplace(*device_, model, false);
        some_as_ = style;
    }
    const double count = share * static_cast<double>(model_->size());
    some_->set_count(static_cast<std::uint32_t>(std::clamp(count, 1.0, double(important_.size()))));
    return *some_;
}

double SplatPicture::most_moving() const {
    return important_.empty() ? 1 : double(important_.size()) / double(splat_count());
}

ForwardOptions SplatPicture::options_for(const Key& key) {
    ForwardOptions options;
    set_options(key.accuracy, options);
    options.kernel = key.kernel;
    options.footprint = key.footprint;
    options.effects = key.effects;
    options.huge_splat_path = key.huge_splat_path;
    options.store_for_backward = key.store;
    options.backward_follows = false;
    if (key.ellipsoids) options.alpha_cutoff = kEllipsoidCutoff;
    // What the passes of these modes read and write is laid out like this.
    if (key.store) options.depth_order = DEPTH_ORDER_CENTRE;
    if (key.store || key.depth) options.storage = STORAGE_FLOAT32;
    return options;
}

SplatPicture::Key SplatPicture::key_for(const DisplaySettings& display, bool moving) const {
    Key key;
    key.kernel = display.kernel;
    key.footprint = has_exact_footprint(key.kernel) ? display.footprint : Footprint::psi;
    const bool plain = display.style == SplatStyle::splats || !own_;
    key.sh_stored = plain ? splats()->sh_degree() : 0;
    key.accuracy = moving ? preset_accuracy(kFast) : display.accuracy;
    key.accuracy.choice[kRenderScale] = 0;  // of the camera
    key.effects = display.effects;
    key.effects.antialias &= display.style == SplatStyle::splats;
    key.huge_splat_path = display.huge_splat_path;
    key.store = display.mode == VIEW_COUNT;
    key.depth = display.mode == VIEW_DEPTH;
    key.ellipsoids = display.style == SplatStyle::ellipsoids && own_;
    if (key.ellipsoids) {
        key.kernel = KERNEL_GAUSSIAN;
        key.footprint = Footprint::psi;
    }
    return key;
}

SplatPicture::Slot& SplatPicture::slot_for(const GpuSplats& splats, const DisplaySettings& display,
                                           bool moving, int pane) {
    const Key key = key_for(display, moving);
    const int degree = std::min(display.sh_degree, splats.sh_degree());
    Slot& slot = slots_[2 * pane + (moving ? 1 : 0)];
    const bool same = slot.forward && key == slot.key;
    compiled_ |= !same || slot.degree != degree;
    slot.degree = degree;
    if (same) return slot;
    slot.buffers.reset();
    slot.forward.reset();
    slot.buffers.emplace(*device_, options_for(key));
    slot.forward.emplace(*device_, options_for(key));
    slot.key = key;
    return slot;
}

void SplatPicture::keep_panes(std::size_t count) {
    slots_.erase(slots_.lower_bound(2 * static_cast<int>(count)), slots_.end());
}

bool SplatPicture::ready_to_move(const DisplaySettings& display, int pane) const {
    const auto kept = slots_.find(2 * pane + 1);
    if (kept == slots_.end()) return false;
    const Slot& slot = kept->second;
    const bool some = important_.empty() || !own_ || (some_ && some_as_ == display.style) ||
                      (levels_ended_ && display.style == SplatStyle::splats);
    return some && slot.forward && slot.key == key_for(display, true) &&
           slot.degree == std::min(display.sh_degree, slot.key.sh_stored);
}

std::vector<PassTime> SplatPicture::rehearse(const Camera& camera, const DisplaySettings& display,
                                             double moving, int pane) {
    Buffer kept = std::exchange(pixels_, Buffer());
    const auto before = std::tuple(size_.x, size_.y, status_);
    const auto put_back = [&] {
        pixels_ = std::move(kept);
        std::tie(size_.x, size_.y, status_) = before;
    };
    try {
        render(camera, display, {}, moving, pane);
    } catch (...) {
        put_back();
        throw;
    }
    put_back();
    return pass_times_;
}

void SplatPicture::render(const Camera& seen, const DisplaySettings& display,
                          const PhotoOverlay& photo, std::optional<double> moving, int pane) {
    compiled_ = false;
    const GpuSplats& shown = moving ? some_styled(display.style, *moving) : styled(display.style);
    Slot& slot = slot_for(shown, display, moving.has_value(), pane);
    Forward& forward = *slot.forward;
    FrameBuffers& buffers = *slot.buffers;
    Frame& frame = buffers.frame();
    Camera camera = seen;
    if (!display.effects.lens) camera.lens = {};
    const bool is_halved =
        display.accuracy.value(kRenderScale) < 1 && display.mode != VIEW_COUNT && !moving;
    const Camera rendered = is_halved ? halved(camera) : camera;
    compiled_ |= is_halved && !upsample_;
    if (is_halved && !upsample_) upsample_.emplace(*device_);
    const bool depth = display.mode == VIEW_DEPTH;
    const FrameView view{camera_data(rendered, shown.origin(), display.near_plane),
                         &exchange_.cameras(), 0, std::min(display.sh_degree, shown.sh_degree()),
                         depth ? glm::vec3(0.0f) : display.background};
    const std::uint64_t bytes = std::uint64_t(camera.width) * camera.height * 4;
    if (pixels_.bytes() < bytes) pixels_ = Buffer(*device_, "pixels", bytes);
    const std::uint32_t intersections =
        std::max(frame.size.intersections,
                 std::min(shown.count() * 2, FrameBuffers::max_intersections(*device_)));
    buffers.reserve(shown.count(), intersections, rendered.width, rendered.height);
    do {
        commands_.begin();
        exchange_.send(commands_, view.camera);
        forward.record_intersections(commands_, shown, view, frame);
        if (depth) record_depth_colours(frame.splats, camera, shown.count());
        forward.record_blend(commands_, view, frame);
        const Buffer& image =
            is_halved ? upsample_->record(commands_, frame.images.image, rendered, camera)
                      : frame.images.image;
        record_display(frame, image, camera, display, photo);
        exchange_.fetch(commands_, frame.counters.status);
        commands_.submit_and_wait();
        status_ = exchange_.status();
    } while (buffers.make_room(status_));
    pass_times_ = commands_.pass_times();
    size_.x = camera.width;
    size_.y = camera.height;
}

void SplatPicture::record_depth_colours(const ProjectedSplats& projected, const Camera& camera,
                                        std::uint32_t splats) {
    if (splats == 0) return;
    const double depth =
        glm::dot(glm::transpose(camera.rotation)[2], bounds_.centre - camera.centre());
    const gpu::DepthLightArgs args{splats,
                                   static_cast<float>(std::max(0.0, depth - 1.5 * bounds_.radius)),
                                   static_cast<float>(std::max(depth, 0.0) + 1.5 * bounds_.radius)};
    commands_.pass("depth colours");
    const Groups g = groups_for(splats);
    commands_.dispatch(depth_light_, args, {projected.bound, projected.light}, g.x, g.y);
}

gpu::DisplayArgs display_args(int width, int height, const DisplaySettings& display,
                              const PhotoOverlay& photo) {
    gpu::DisplayArgs args{};
    args.width = static_cast<std::uint32_t>(width);
    args.height = static_cast<std::uint32_t>(height);
    args.tiles_x = (args.width + TILE_SIZE - 1) / TILE_SIZE;
    args.heat_max = display.mode == VIEW_COUNT ? display.count_max : display.error_max;
    args.background_r = display.background.r;
    args.background_g = display.background.g;
    args.background_b = display.background.b;
    if (photo.photo != nullptr) {
        args.photo_x = static_cast<float>(photo.x);
        args.photo_y = static_cast<float>(photo.y);
        args.photo_scale = static_cast<float>(photo.scale);
        args.photo_width = static_cast<std::uint32_t>(photo.width);
        args.photo_height = static_cast<std::uint32_t>(photo.height);
    }
    return args;
}

void SplatPicture::record_display(const Frame& frame, const Buffer& image, const Camera& camera,
                                  const DisplaySettings& display, const PhotoOverlay& photo) {
    const gpu::DisplayArgs args = display_args(camera.width, camera.height, display, photo);
    const bool has_photo = photo.photo != nullptr && display.mode == VIEW_ERROR;
    Pipeline& pipeline = display_pipelines_[display.mode * 2 + (has_photo ? 1 : 0)];
    compiled_ |= !pipeline;
    if (!pipeline)
        pipeline = Pipeline(
            *device_, "display",
            {{"THREADS", VIEW_GROUP}, {"MODE", display.mode}, {"HAS_PHOTO", has_photo ? 1 : 0}});
    commands_.pass("display");
    const Groups g = groups_for(std::uint64_t(args.width) * args.height, VIEW_GROUP);
    commands_.dispatch(pipeline, args,
                       {image, has_photo ? *photo.photo : no_photo_, frame.intersections.tile_range,
                        frame.images.last_intersection, pixels_},
                       g.x, g.y);
}

}  // namespace darb
