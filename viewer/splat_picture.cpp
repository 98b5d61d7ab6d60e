// SPDX-License-Identifier: MIT
#include "viewer/splat_picture.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "engine/core/error.h"
#include "engine/primitives/groups.h"
#include "engine/raster/frame_view.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_model.h"
#include "viewer/guides.h"

namespace darb {

namespace {

constexpr float kRemovedLogit = -100;  // the shader clamps it to -30, far below any cut-off
constexpr float kOpaqueLogit = 8;
constexpr float kTransparentLogit = -2.2f;  // an opacity of 0.1
// The highlight of a selection is orange; these are (colour - 0.5) / 0.2821 of each channel.
constexpr float kHighlightDc[3] = {1.77f, 0.71f, -1.6f};
constexpr float kHighlightShare = 0.65f;
// Ellipsoids are cut where alpha falls below 0.9. A Gaussian does so at sqrt(2 ln(1/0.9)) = 0.459
// standard deviations, so they are drawn 2 / 0.459 times as large.
constexpr float kEllipsoidCutoff = 0.9f;
constexpr float kEllipsoidGrowth = 1.472f;  // ln(2 / 0.459)
constexpr float kPointLogScale = -20;  // leaves only the low-pass filter: a dot of about two pixels
constexpr int kRehearsal = -1;         // used in place of a pane for pictures that nobody sees

// A copy in a style has no harmonics.
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
    if (style == SplatStyle::ellipsoids) {  // nearly transparent splats would hide the rest
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
      depth_light_(device, "view_depth", {{"THREADS", VIEW_GROUP}}),
      nothing_(device, "nothing", 4) {}

void SplatPicture::set_scene(const SplatModel& model, const Bounds& bounds,
                             std::vector<std::uint32_t> important) {
    if (const std::uint32_t most = GpuSplats::max_count(*device_, model.sh_degree, false);
        model.size() > most)
        throw Error(
            "the scene",
            fmt::format("has {} splats, {} can hold {}", model.size(), device_->info().name, most),
            "Choose another device (darb devices), or prune the scene.");
    settle();
    own_ = GpuSplats(*device_, model, false);
    styled_.reset();
    some_.reset();
    probe_.reset();
    drop_levels();
    live_ = nullptr;
    model_ = &model;
    bounds_ = bounds;
    marks_ = {};
    important_ = std::move(important);
}

void SplatPicture::set_mesh(const TriangleMesh* mesh) {
    std::optional<MeshPicture> made;
    if (mesh) made.emplace(*device_, *mesh);
    settle();
    mesh_ = std::move(made);
}

MeshShow SplatPicture::shown_mesh(const DisplaySettings& display) const {
    const bool shown = mesh_ && display.mode == VIEW_COLOUR && display.mesh != MeshShow::beside;
    return shown ? display.mesh : MeshShow::none;
}

std::optional<glm::dvec3> SplatPicture::surface_at(const Camera& camera,
                                                   const DisplaySettings& display,
                                                   const glm::dvec2& px) {
    if (!own_) return {};
    settle();
    DisplaySettings plain = display;  // as the splats are, however they are shown
    plain.style = SplatStyle::splats;
    plain.mode = VIEW_COLOUR;
    plain.mesh = MeshShow::none;
    const Key key = key_for(plain, false);
    if (!probe_ || !probe_->is_for(key.kernel, key.effects))
        probe_.emplace(*device_, options_for(key));
    return probe_->find(*own_, camera, display.near_plane, px);
}

void SplatPicture::set_live(const GpuSplats& splats, const Bounds& bounds) {
    clear();
    live_ = &splats;
    bounds_ = bounds;
}

void SplatPicture::clear() {
    settle();
    mesh_.reset();
    probe_.reset();
    own_.reset();
    styled_.reset();
    some_.reset();
    drop_levels();
    important_.clear();
    slots_.clear();
    live_ = nullptr;
    model_ = nullptr;
    marks_ = {};
}

void SplatPicture::set_marks(const std::vector<std::uint8_t>& unseen,
                             const std::vector<std::uint8_t>& selected) {
    if (!own_) return;
    marks_.unseen = unseen;
    marks_.selected = selected;
    SplatModel marked;
    marked.opacity_logit = model_->opacity_logit;
    const bool tints = std::find(selected.begin(), selected.end(), 1) != selected.end();
    if (tints || marks_.tinted) marked.sh_dc = model_->sh_dc;
    apply_marks({}, marked);
    marks_.opacity_logit = std::move(marked.opacity_logit);
    marks_.sh_dc = std::move(marked.sh_dc);
    marks_.tinted = tints;
    if (styled_) drop(std::move(*styled_));
    if (some_) drop(std::move(*some_));
    styled_.reset();
    some_.reset();
    drop_levels();
}

void SplatPicture::apply_marks(const std::vector<std::uint32_t>& splats, SplatModel& copy) const {
    const size_t count = copy.opacity_logit.size();
    for (size_t i = 0; i < count; ++i) {
        const size_t of = splats.empty() ? i : splats[i];
        if (of < marks_.unseen.size() && marks_.unseen[of] != 0)
            copy.opacity_logit[i] = kRemovedLogit;
        if (of >= marks_.selected.size() || marks_.selected[of] == 0 || copy.sh_dc.empty())
            continue;
        for (size_t c = 0; c < 3; ++c)
            copy.sh_dc[3 * i + c] =
                glm::mix(copy.sh_dc[3 * i + c], kHighlightDc[c], kHighlightShare);
    }
}

void SplatPicture::update_scene() {
    if (!own_) return;
    settle();
    own_ = GpuSplats(*device_, *model_, false);
    marks_.tinted = false;
    marks_.opacity_logit.clear();
    marks_.sh_dc.clear();
    styled_.reset();
    some_.reset();
    drop_levels();
}

void SplatPicture::add_level(const SplatModel& level) {
    const auto same = std::find_if(levels_.begin(), levels_.end(),
                                   [&](const GpuSplats& l) { return l.count() == level.size(); });
    GpuSplats splats(*device_, level, false);
    if (same == levels_.end())
        levels_.push_back(std::move(splats));
    else
        drop(std::exchange(*same, std::move(splats)));
}

void SplatPicture::drop_levels() {
    for (GpuSplats& level : levels_) drop(std::move(level));
    levels_.clear();
    levels_ended_ = false;
}

// The largest level that is not above the share that was asked for.
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
    settle();
    styled_.reset();
    styled_.emplace(*device_, model, false);
    styled_as_ = style;
    return *styled_;
}

// A level where there is one, else the beginning of a copy in the order of importance.
const GpuSplats& SplatPicture::some_styled(SplatStyle style, double share) {
    if (share >= 1 || important_.empty() || !own_) return styled(style);
    if (const GpuSplats* level = level_of(style, share)) return *level;
    if (!some_ || some_as_ != style) {
        SplatModel model = in_style(pick_splats(*model_, important_), style);
        apply_marks(important_, model);
        compiled_ = true;
        settle();
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
    // The passes of these modes read and write the layout that these options choose.
    if (key.store || key.mesh) options.depth_order = DEPTH_ORDER_CENTRE;
    if (key.store || key.depth || key.mesh) options.storage = STORAGE_FLOAT32;
    return options;
}

SplatPicture::Key SplatPicture::key_for(const DisplaySettings& display, bool moving) const {
    Key key;
    key.kernel = display.kernel;
    key.footprint = has_exact_footprint(key.kernel) ? display.footprint : Footprint::psi;
    const bool plain = display.style == SplatStyle::splats || !own_;
    key.sh_stored = plain ? splats()->sh_degree() : 0;
    key.accuracy = moving ? preset_accuracy(kFast) : display.accuracy;
    key.accuracy.choice[kRenderScale] = 0;  // the camera has the scale already
    key.effects = display.effects;
    key.effects.antialias &= display.style == SplatStyle::splats;
    key.huge_splat_path = display.huge_splat_path;
    key.store = display.mode == VIEW_COUNT;
    key.depth = display.mode == VIEW_DEPTH;
    key.mesh = shown_mesh(display) == MeshShow::both;
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
    settle();
    slot.buffers.reset();
    slot.forward.reset();
    slot.mesh_blend.reset();
    slot.buffers.emplace(*device_, options_for(key));
    slot.forward.emplace(*device_, options_for(key));
    if (key.mesh) slot.mesh_blend.emplace(*device_, options_for(key));
    slot.key = key;
    slot.fresh = true;
    return slot;
}

void SplatPicture::keep_panes(std::size_t count) {
    const int end = static_cast<int>(count);
    const auto slots = slots_.lower_bound(2 * end);
    const auto images = images_.lower_bound(end);
    if (slots == slots_.end() && images == images_.end()) return;
    settle();
    slots_.erase(slots, slots_.end());
    images_.erase(images, images_.end());
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

void SplatPicture::render(const Camera& camera, const DisplaySettings& display,
                          const PhotoOverlay& photo, std::optional<double> moving, int pane) {
    Job job = prepare(camera, display, photo, moving, pane);
    prepare_image(job, pane);
    render(job);
}

void SplatPicture::start(int frame, const Camera& camera, const DisplaySettings& display,
                         const PhotoOverlay& photo, std::optional<double> moving, int pane) {
    Job job = prepare(camera, display, photo, moving, pane);
    prepare_image(job, pane);
    give(frame, job);
}

void SplatPicture::rehearse(int frame, const Camera& camera, const DisplaySettings& display,
                            double moving, int pane) {
    Job job = prepare(camera, display, {}, moving, pane);
    prepare_image(job, kRehearsal);
    give(frame, job);
}

SplatPicture::Job SplatPicture::prepare(const Camera& camera, const DisplaySettings& display,
                                        const PhotoOverlay& photo, std::optional<double> moving,
                                        int pane) {
    compiled_ = false;
    Job job{camera, {}, display, photo};
    job.splats = moving ? &some_styled(display.style, *moving) : &styled(display.style);
    job.slot = &slot_for(*job.splats, display, moving.has_value(), pane);
    job.mesh = shown_mesh(display);
    if (!display.effects.lens || job.mesh != MeshShow::none)
        job.camera.lens = {};  // a mesh has none
    const bool is_halved = display.accuracy.value(kRenderScale) < 1 && display.mode != VIEW_COUNT &&
                           !moving && job.mesh != MeshShow::alone;
    job.rendered = is_halved ? halved(job.camera) : job.camera;
    compiled_ |= is_halved && !upsample_;
    if (is_halved && !upsample_) upsample_.emplace(*device_);
    const bool has_photo = photo.photo != nullptr && display.mode == VIEW_ERROR;
    job.pipeline = &display_pipelines_[display.mode * 2 + (has_photo ? 1 : 0)];
    compiled_ |= !*job.pipeline;
    if (!*job.pipeline)
        *job.pipeline = Pipeline(
            *device_, "display",
            {{"THREADS", VIEW_GROUP}, {"MODE", display.mode}, {"HAS_PHOTO", has_photo ? 1 : 0}});
    reserve(job);
    return job;
}

void SplatPicture::reserve(const Job& job) {
    const std::uint32_t splats = job.splats->count();
    const int width = job.rendered.width, height = job.rendered.height;
    const std::uint64_t pixels = std::uint64_t(width) * std::uint64_t(height),
                        shown = std::uint64_t(job.camera.width) * std::uint64_t(job.camera.height);
    FrameBuffers& buffers = *job.slot->buffers;
    const FrameSize& has = buffers.size();
    const std::uint32_t intersections = std::max(
        has.intersections, std::min(splats * 2, FrameBuffers::max_intersections(*device_)));
    if (splats > has.splats || intersections > has.intersections || pixels > has.pixels ||
        image_tiles(width, height) > has.tiles || shown > most_pixels_)
        settle();
    if (job.mesh != MeshShow::none && !mesh_->has_room(width, height)) {
        settle();
        mesh_->reserve(width, height);
    }
    most_pixels_ = std::max(most_pixels_, shown);
    buffers.reserve(splats, intersections, width, height);
}

// Writes the older of the two images.
void SplatPicture::prepare_image(Job& job, int index) {
    Image& image = images_[index];
    const std::uint64_t bytes =
        std::uint64_t(job.camera.width) * std::uint64_t(job.camera.height) * 4;
    if (image.before.bytes() < bytes) {
        settle();
        image.before = Buffer(*device_, "pixels", bytes);
    }
    std::swap(image.now, image.before);
    image.size_before = std::exchange(image.size, {job.camera.width, job.camera.height});
    job.image = &image;
}

void SplatPicture::render(const Job& job) {
    if (!under_way_.empty()) settle();  // a flag of theirs would be taken for one of this picture
    job.slot->fresh = false;
    rendered_ = {};
    do {
        std::unique_ptr<Flight> flight = free_flight();
        record(job, *flight);
        flight->commands.submit_and_wait();
        flight->uploads.clear();
        rendered_.status = flight->exchange.status();
        rendered_.passes = flight->commands.pass_times();
        free_.push_back(std::move(flight));
    } while (job.slot->buffers->make_room(rendered_.status));
}

// The first picture of a slot compiles, and its buffers are a guess, so nothing would be seen until
// it is done.
void SplatPicture::give(int frame, const Job& job) {
    if (job.slot->fresh) {
        render(job);
        rendered_.frame = frame;
        done_.push_back(rendered_);
        return;
    }
    std::unique_ptr<Flight> flight = free_flight();
    flight->frame = frame;
    flight->slot = job.slot;
    record(job, *flight);
    flight->commands.submit();
    under_way_.push_back(std::move(flight));
}

std::unique_ptr<SplatPicture::Flight> SplatPicture::free_flight() {
    if (free_.empty()) return std::make_unique<Flight>(*device_);
    std::unique_ptr<Flight> flight = std::move(free_.back());
    free_.pop_back();
    flight->in_vain = false;
    return flight;
}

void SplatPicture::finish(int frame) {
    while (!under_way_.empty() && under_way_.front()->frame <= frame) land();
}

std::vector<StartedPicture> SplatPicture::take_done() {
    while (!under_way_.empty() && under_way_.front()->commands.done()) land();
    return std::exchange(done_, {});
}

// Waits for the oldest picture under way.
void SplatPicture::land() {
    std::unique_ptr<Flight> flight = std::move(under_way_.front());
    under_way_.pop_front();
    flight->commands.wait();
    StartedPicture made;
    made.frame = flight->frame;
    made.status = flight->exchange.status();
    made.passes = flight->commands.pass_times();
    try {
        made.whole = !make_room(*flight, made.status);
    } catch (const DeviceLost&) {
        throw;
    } catch (const Error& e) {
        made.whole = false;
        made.error = e.what();
    }
    flight->uploads.clear();
    flight->dropped.clear();
    done_.push_back(std::move(made));
    free_.push_back(std::move(flight));
}

// The flag of a frame without room stays until the host clears it, so later frames in the same
// buffers have it, too.
bool SplatPicture::make_room(Flight& flight, const gpu::FrameStatus& status) {
    if (flight.in_vain) return true;
    gpu::FrameStatus wanted = status;
    if (status.overflow != 0) device_->wait_idle();
    for (const auto& later : under_way_) {
        if (status.overflow == 0 || later->slot != flight.slot) continue;
        later->in_vain = true;
        const gpu::FrameStatus its = later->exchange.status();
        wanted.overflow |= its.overflow;
        wanted.intersections = std::max(wanted.intersections, its.intersections);
        wanted.longest_list = std::max(wanted.longest_list, its.longest_list);
    }
    return flight.slot->buffers->make_room(wanted);
}

void SplatPicture::settle() {
    device_->wait_idle();
    while (!under_way_.empty()) land();
}

// Pictures under way may still read them.
void SplatPicture::drop(GpuSplats splats) {
    if (!under_way_.empty()) under_way_.back()->dropped.push_back(std::move(splats));
}

const SplatPicture::Image& SplatPicture::image_of(int pane) const {
    static const Image kNone;
    const auto image = images_.find(pane);
    return image == images_.end() ? kNone : image->second;
}

void SplatPicture::record(const Job& job, Flight& flight) {
    if (job.mesh != MeshShow::alone) return record_splats(job, flight);
    const Buffer& status = job.slot->buffers->frame().counters.status;
    flight.commands.begin();
    record_uploads(flight);
    flight.commands.fill(status, 0);  // it is no frame of splats
    mesh_->record(flight.commands, job.camera, job.display, job.image->now);
    flight.exchange.fetch(flight.commands, status);
}

void SplatPicture::record_splats(const Job& job, Flight& flight) {
    Forward& forward = *job.slot->forward;
    Frame& frame = job.slot->buffers->frame();
    const DisplaySettings& display = job.display;
    const bool depth = display.mode == VIEW_DEPTH;
    const FrameView view{camera_data(job.rendered, job.splats->origin(), display.near_plane),
                         &flight.exchange.cameras(), 0,
                         std::min(display.sh_degree, job.splats->sh_degree()),
                         depth ? glm::vec3(0.0f) : display.background};
    Commands& commands = flight.commands;
    commands.begin();
    record_uploads(flight);
    flight.exchange.send(commands, view.camera);
    forward.record_intersections(commands, *job.splats, view, frame);
    if (depth) record_depth_colours(job, commands);
    if (job.mesh == MeshShow::both) {
        mesh_->record(commands, job.rendered, display);
        job.slot->mesh_blend->record(commands, job.rendered, *mesh_, display.mesh_nearer, frame);
    } else {
        forward.record_blend(commands, view, frame);
    }
    const bool is_halved =
        job.rendered.width != job.camera.width || job.rendered.height != job.camera.height;
    const Buffer& image =
        is_halved ? upsample_->record(commands, frame.images.image, job.rendered, job.camera)
                  : frame.images.image;
    record_display(job, image, commands);
    flight.exchange.fetch(commands, frame.counters.status);
}

// Records the marks that have changed since the last picture.
void SplatPicture::record_uploads(Flight& flight) {
    const auto upload = [&](int attribute, std::vector<float>& values) {
        if (values.empty() || !own_) return;
        const std::uint64_t bytes = values.size() * sizeof(float);
        Buffer host(*device_, "marks", bytes, Memory::waiting);
        std::memcpy(host.mapped(), values.data(), bytes);
        flight.commands.copy(host, own_->parameters(attribute), bytes);
        flight.uploads.push_back(std::move(host));
        values.clear();
    };
    upload(kOpacityLogit, marks_.opacity_logit);
    upload(kShDc, marks_.sh_dc);
}

void SplatPicture::record_depth_colours(const Job& job, Commands& commands) {
    const std::uint32_t splats = job.splats->count();
    if (splats == 0) return;
    const auto [near_depth, far_depth] = depth_range(job.camera, bounds_);
    const gpu::DepthLightArgs args{splats, static_cast<float>(near_depth),
                                   static_cast<float>(far_depth)};
    commands.pass("depth colours");
    const Groups g = groups_for(splats);
    const ProjectedSplats& projected = job.slot->buffers->frame().splats;
    commands.dispatch(depth_light_, args, {projected.bound, projected.light}, g.x, g.y);
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

void SplatPicture::record_display(const Job& job, const Buffer& image, Commands& commands) {
    const Image& shown = *job.image;
    const Frame& frame = job.slot->buffers->frame();
    gpu::DisplayArgs args = display_args(shown.size.x, shown.size.y, job.display, job.photo);
    const bool has_photo = job.photo.photo != nullptr && job.display.mode == VIEW_ERROR;
    const bool has_before = shown.size_before.x > 0;
    if (has_before) {
        args.before_width = static_cast<std::uint32_t>(shown.size_before.x);
        args.before_height = static_cast<std::uint32_t>(shown.size_before.y);
    }
    commands.pass("display");
    const Groups g = groups_for(std::uint64_t(args.width) * args.height, VIEW_GROUP);
    commands.dispatch(*job.pipeline, args,
                      {image, has_photo ? *job.photo.photo : nothing_,
                       frame.intersections.tile_range, frame.images.last_intersection,
                       frame.counters.status, has_before ? shown.before : nothing_, shown.now},
                      g.x, g.y);
}

}  // namespace darb
