#include "viewer/splat_picture.h"

#include <algorithm>

#include "engine/core/error.h"
#include "engine/render/groups.h"

namespace darb {

namespace {

constexpr float kRemovedLogit = -100;  // clamped to -30: far below any cut-off
constexpr float kOpaqueLogit = 8;
// Ellipsoids: cut where alpha falls below 0.9. A Gaussian is there at sqrt(2 ln(1/0.9)) = 0.459
// standard deviations, so they are drawn 2 / 0.459 times as large.
constexpr float kEllipsoidCutoff = 0.9f;
constexpr float kEllipsoidGrowth = 1.472f;  // ln(2 / 0.459)
constexpr float kPointLogScale = -20;       // leaves the low-pass: a dot of about two pixels

SplatModel with_sh_degree(const SplatModel& m, int degree) {
    SplatModel out = m;
    if (degree >= m.sh_degree) return out;
    out.sh_degree = degree;
    out.sh_rest.clear();
    const size_t from = static_cast<size_t>(m.rest_count());
    const size_t to = static_cast<size_t>(out.rest_count());
    out.sh_rest.reserve(m.size() * to);
    for (size_t i = 0; i < m.size(); ++i) {
        const auto begin = m.sh_rest.begin() + static_cast<std::ptrdiff_t>(i * from);
        out.sh_rest.insert(out.sh_rest.end(), begin, begin + static_cast<std::ptrdiff_t>(to));
    }
    return out;
}

// The highest degree whose buffers the device can bind.
int fitting_degree(const Device& device, const SplatModel& model) {
    for (int degree = model.sh_degree; degree >= 0; --degree)
        if (model.size() <= GpuSplats::max_count(device, degree, false)) return degree;
    throw Error("the scene",
                fmt::format("has {} splats, {} can bind {}", model.size(), device.info().name,
                            GpuSplats::max_count(device, 0, false)),
                "Choose another device (darb devices), or prune the scene.");
}

}  // namespace

SplatPicture::SplatPicture(Device& device)
    : device_(&device),
      commands_(device),
      depth_light_(device, "view_depth", {{"THREADS", VIEW_GROUP}}),
      no_photo_(device, "no photo", 4) {}

void SplatPicture::set_scene(const SplatModel& model, const Bounds& bounds) {
    const int degree = fitting_degree(*device_, model);
    std::optional<GpuSplats> next;
    if (degree == model.sh_degree)
        next.emplace(*device_, model, false);
    else
        next.emplace(*device_, with_sh_degree(model, degree), false);
    own_ = std::move(next);
    styled_.reset();
    live_ = nullptr;
    model_ = &model;
    bounds_ = bounds;
    removed_.clear();
}

void SplatPicture::set_live(const GpuSplats& splats, const Bounds& bounds) {
    own_.reset();
    styled_.reset();
    model_ = nullptr;
    live_ = &splats;
    bounds_ = bounds;
}

void SplatPicture::clear() {
    own_.reset();
    styled_.reset();
    slots_ = {};
    live_ = nullptr;
    model_ = nullptr;
}

void SplatPicture::upload_opacity(GpuSplats& splats, const std::vector<float>& opacity) {
    std::vector<float> values = opacity;
    for (size_t i = 0; i < removed_.size(); ++i)
        if (removed_[i] != 0) values[i] = kRemovedLogit;
    if (!values.empty()) splats.parameters(kOpacity).upload(values);
}

void SplatPicture::set_removed(const std::vector<std::uint8_t>& removed) {
    if (!own_) return;
    removed_ = removed;
    upload_opacity(*own_, model_->opacity);
    styled_.reset();
}

const GpuSplats& SplatPicture::styled(SplatStyle style) {
    if (style == SplatStyle::splats || !own_) return *splats();
    if (styled_ && styled_as_ == style) return *styled_;
    SplatModel model = with_sh_degree(*model_, 0);
    std::fill(model.opacity.begin(), model.opacity.end(), kOpaqueLogit);
    for (float& s : model.log_scale)
        s = style == SplatStyle::points ? kPointLogScale : s + kEllipsoidGrowth;
    if (style == SplatStyle::ellipsoids) {  // what is nearly transparent would hide the rest
        for (size_t i = 0; i < model.size(); ++i)
            if (model_->opacity[i] < -2.2f) model.opacity[i] = kRemovedLogit;
        model.kernel = KERNEL_GAUSSIAN;
    }
    styled_.reset();
    styled_.emplace(*device_, model, false);
    styled_as_ = style;
    upload_opacity(*styled_, model.opacity);
    return *styled_;
}

ForwardOptions SplatPicture::options_for(const Key& key) {
    ForwardOptions options;
    set_options(key.accuracy, options);
    options.kernel = key.kernel;
    options.footprint = key.footprint;
    options.sh_stored = key.sh_stored;
    options.effects.antialias = key.antialias;
    options.store_for_backward = key.store;
    if (key.ellipsoids) options.alpha_cutoff = kEllipsoidCutoff;
    // What the passes of these modes read and write is laid out like this.
    if (key.store) options.depth_order = DEPTH_ORDER_CENTRE;
    if (key.store || key.depth) options.storage = STORAGE_FLOAT32;
    return options;
}

Forward& SplatPicture::forward_for(const GpuSplats& splats, const DisplaySettings& display,
                                   bool moving) {
    Key key;
    key.kernel = display.kernel;
    key.footprint = display.footprint;
    key.sh_stored = splats.sh_degree();
    key.accuracy = moving ? preset_accuracy(kFast) : display.accuracy;
    key.antialias = display.antialias && display.style == SplatStyle::splats;
    key.store = display.mode == VIEW_COUNT;
    key.depth = display.mode == VIEW_DEPTH;
    key.ellipsoids = display.style == SplatStyle::ellipsoids && own_;
    if (key.ellipsoids) {
        key.kernel = KERNEL_GAUSSIAN;
        key.footprint = Footprint::psi;
    }
    Slot& slot = slots_[moving ? 1 : 0];
    if (slot.forward && key == slot.key) return *slot.forward;
    compiled_ = true;
    slot.forward.reset();
    slot.forward.emplace(*device_, options_for(key));
    slot.key = key;
    return *slot.forward;
}

void SplatPicture::render(const Camera& camera, const DisplaySettings& display,
                          const PhotoOverlay& photo, bool moving) {
    compiled_ = false;
    const GpuSplats& shown = styled(display.style);
    Forward& forward = forward_for(shown, display, moving);
    const gpu::CameraData data = camera_data(camera, shown.origin(), display.near_plane);
    const Buffer cameras = upload_cameras(*device_, {data});
    const int degree = std::min(display.sh_degree, shown.sh_degree());
    forward.before_blend = nullptr;
    glm::vec3 background = display.background;
    if (display.mode == VIEW_DEPTH) {
        background = glm::vec3(0.0f);
        const double depth =
            glm::dot(glm::transpose(camera.rotation)[2], bounds_.centre - camera.centre());
        const gpu::DepthLightArgs args{
            shown.count(), static_cast<float>(std::max(0.0, depth - 1.5 * bounds_.radius)),
            static_cast<float>(std::max(depth, 0.0) + 1.5 * bounds_.radius)};
        forward.before_blend = [this, args, &forward](Commands& commands) {
            if (args.splat_count == 0) return;
            commands.pass("depth colours");
            const Groups g = groups_for(args.splat_count);
            commands.dispatch(depth_light_, args, {forward.splat_bound(), forward.splat_light()},
                              g.x, g.y);
        };
    }
    const std::uint64_t bytes = std::uint64_t(camera.width) * camera.height * 4;
    if (pixels_.bytes() < bytes) pixels_ = Buffer(*device_, "pixels", bytes);
    const std::uint32_t pairs = std::max(forward.pair_capacity(),
                                         std::min(shown.count() * 2, Forward::max_pairs(*device_)));
    forward.reserve(shown.count(), pairs, camera.width, camera.height);
    do {
        commands_.begin();
        forward.record(commands_, shown, cameras, 0, data, degree, background);
        record_display(commands_, forward, data, display, photo);
        commands_.submit_and_wait();
        status_ = forward.read_status();
    } while (forward.make_room(status_));
    pass_times_ = commands_.pass_times();
    width_ = camera.width;
    height_ = camera.height;
}

void SplatPicture::record_display(Commands& commands, const Forward& forward,
                                  const gpu::CameraData& data, const DisplaySettings& display,
                                  const PhotoOverlay& photo) {
    gpu::DisplayArgs args{};
    args.width = data.width;
    args.height = data.height;
    args.tiles_x = data.tiles_x;
    args.heat_max = display.mode == VIEW_COUNT ? display.count_max : display.error_max;
    args.background_r = display.background.r;
    args.background_g = display.background.g;
    args.background_b = display.background.b;
    if (photo.photo != nullptr) {
        args.split = static_cast<float>(photo.split * data.width);
        args.photo_x = static_cast<float>(photo.x);
        args.photo_y = static_cast<float>(photo.y);
        args.photo_scale = static_cast<float>(photo.scale);
        args.photo_width = static_cast<std::uint32_t>(photo.width);
        args.photo_height = static_cast<std::uint32_t>(photo.height);
    }
    const bool has_photo = photo.photo != nullptr;
    Pipeline& pipeline = display_pipelines_[display.mode * 2 + (has_photo ? 1 : 0)];
    compiled_ |= !pipeline;
    if (!pipeline)
        pipeline = Pipeline(
            *device_, "display",
            {{"THREADS", VIEW_GROUP}, {"MODE", display.mode}, {"HAS_PHOTO", has_photo ? 1 : 0}});
    commands.pass("display");
    const Groups g = groups_for(std::uint64_t(data.width) * data.height, VIEW_GROUP);
    commands.dispatch(pipeline, args,
                      {forward.image(), has_photo ? *photo.photo : no_photo_, forward.tile_range(),
                       forward.last_pair(), pixels_},
                      g.x, g.y);
}

}  // namespace darb
