#include "trainer/trainer.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>
#include <utility>

#include "engine/core/check.h"
#include "engine/core/error.h"
#include "engine/core/rng.h"
#include "engine/render/renderer.h"

namespace darb {

namespace {

// While a probe runs, the rate of the bands above the first over that of the first.
constexpr float kProbeRestRate = 0.2f;
constexpr int kFilterInterval = 100;  // iterations, as Mip-Splatting

// More splats than this share with a gradient that is not finite: something is broken.
constexpr std::uint64_t kBadGradientShare = 1'000;
constexpr double kMostPairs =
    0.7;  // of what the device binds: beyond, splats do not grow in number

SplatModel start_model(SplatModel start, const TrainOptions& options) {
    start.antialias = options.antialias;
    if (options.probe_sh) {
        start.sh_degree = 0;
        start.sh_rest.clear();
    }
    return start;
}

int largest(const Dataset& dataset, int Camera::*side) {
    int most = 1;
    for (const View& v : dataset.views) most = std::max(most, v.camera.*side);
    return most;
}

}  // namespace

ForwardOptions forward_options(const TrainOptions& options) {
    ForwardOptions f;
    f.kernel = options.kernel;
    f.footprint = options.footprint;
    set_options(options.accuracy, f);
    f.effects = options.projection;
    f.effects.antialias = f.effects.smoothing = options.antialias;
    f.crowds = options.crowds;
    f.store_for_backward = true;
    return f;
}

Trainer::Flight::Flight(Device& device)
    : loss(device, "loss result", sizeof(gpu::LossResult), Memory::host),
      status(device, "status result", sizeof(gpu::FrameStatus), Memory::host),
      commands(device) {}

Trainer::Trainer(Device& device, const Dataset& dataset, const std::vector<ImageU8>& photos,
                 const SplatModel& start, const TrainOptions& options)
    : device_(&device),
      options_(options),
      schedule_(options),
      background_(options.white_background ? 1.0f : 0.0f),
      extent_(scene_extent(dataset)),
      reach_(scene_reach(dataset)),
      nearest_(nearest_points(dataset)),
      next_probe_(schedule_.degree_interval),
      splats_(device, start_model(start, options), true, schedule_.rest_every > 1),
      buffers_(device, forward_options(options)),
      forward_(device, forward_options(options)),
      backward_(device, forward_options(options), BackwardResult::update),
      loss_(device, largest(dataset, &Camera::width), largest(dataset, &Camera::height),
            LossOptions{.use_alpha = options.alpha,
                        .use_mask = options.alpha && dataset.alpha_is_mask}),
      density_(device, options.kernel),
      average_(device),
      flights_{Flight(device), Flight(device)} {
    if (options_.max_memory_bytes) device.set_memory_budget(*options_.max_memory_bytes);
    add_photos(dataset.views, options, demand_);
    DARB_CHECK(photos.size() == dataset.views.size(), "{} photos, {} views", photos.size(),
               dataset.views.size());
    std::uint64_t pixels = 1;
    for (size_t i = 0; i < dataset.views.size(); ++i) {
        const View& view = dataset.views[i];
        camera_data_.push_back(camera_data(view.camera, splats_.origin()));
        names_.push_back(view.name);
        photos_.emplace_back();
        if (view.is_test) continue;
        train_views_.push_back(static_cast<int>(i));
        const std::uint64_t count = std::uint64_t(view.camera.width) * view.camera.height;
        DARB_CHECK(photos[i].channels == 4 && photos[i].data.size() == count * 4, "{}", view.name);
        photos_.back() = Buffer(device, "photo " + view.name, count * 4);
        photos_.back().upload(std::as_bytes(std::span(photos[i].data)));
        pixels = std::max(pixels, count);
    }
    if (train_views_.empty())
        throw Error(dataset.root.string(), "no photo is left to train on",
                    "Every view is held out: add photos, or leave out --eval of darb train.");
    cameras_ = upload_cameras(device, camera_data_);
    d_image_ = Buffer(device, "d_image", pixels * 12);
    if (options_.antialias) {
        smoothing_.emplace(device, forward_.options().effects);
        std::vector<gpu::CameraData> train_data;
        for (const int view : train_views_) train_data.push_back(camera_data_[view]);
        train_cameras_ = upload_cameras(device, train_data);
    }
    if (options_.morton_order) morton_.emplace(device);
    if (options_.exposure)
        exposure_.emplace(device, static_cast<std::uint32_t>(train_views_.size()), pixels);
    make_strategy(dataset);
    settle_effects(0);
    buffers_.reserve(splats_.count(), splats_.count() * 4, largest(dataset, &Camera::width),
                     largest(dataset, &Camera::height));
}

int Trainer::degree_at(int iteration) const {
    if (options_.probe_sh) return splats_.sh_degree();
    return schedule_.sh_degree(iteration);
}

int Trainer::sh_degree() const {
    return degree_at(iteration_);
}

int Trainer::view_for(int iteration) {
    if (!probe_views_.empty()) return probe_views_[iteration % probe_views_.size()];
    const int count = static_cast<int>(train_views_.size());
    const int epoch = (iteration - 1) / count;
    if (epoch != order_epoch_) {
        order_ = train_views_;
        Pcg32 random(options_.seed, 1000 + static_cast<std::uint64_t>(epoch));
        for (int i = count - 1; i > 0; --i) std::swap(order_[i], order_[random.below(i + 1)]);
        order_epoch_ = epoch;
    }
    return order_[(iteration - 1) % count];
}

glm::vec3 Trainer::background_for(int iteration) const {
    if (!options_.random_background) return background_;
    Pcg32 random(options_.seed, 0x6261636Bull << 32 | static_cast<std::uint32_t>(iteration));
    glm::vec3 colour;
    for (int c = 0; c < 3; ++c) colour[c] = static_cast<float>(random.uniform());
    return colour;
}

AdamStep Trainer::rates(int iteration) const {
    const Schedule::Rates now = schedule_.rates(iteration);
    AdamStep step;
    step.position = static_cast<float>(now.position * extent_);
    step.scale = now.scale;
    step.rotation = now.rotation;
    step.opacity = now.opacity;
    step.sh_dc = now.sh_dc;
    step.rest_every = schedule_.rest_every;
    step.sh_rest = now.sh_rest;
    if (!probe_views_.empty()) {
        step.rest_every = 1;
        step.sh_rest = kProbeRestRate * step.sh_dc;
        for (float* rate : {&step.position, &step.scale, &step.rotation, &step.opacity, &step.sh_dc,
                            &step.sh_rest})
            *rate *= probe_rate_;
    }
    step = adam_step(step, iteration);
    step.opacity_weight = options_.opacity_weight;
    step.scale_weight =
        options_.scale_weight / static_cast<float>(schedule_.length_scale * extent_);
    if (schedule_.largest_scale > 0)
        step.largest_log_scale =
            static_cast<float>(std::log(schedule_.largest_scale * schedule_.length_scale * reach_));
    step.regularise_unseen = schedule_.regularises_unseen(train_views_.size(), iteration);
    return step;
}

// Density control opens the next iteration rather than closing its own, so that what is evaluated
// and saved between them is what was trained, not what was just reset.
void Trainer::step() {
    if (iteration_ > 0) {
        density_control(iteration_);
        settle_effects(iteration_);
    }
    settle_resolution(iteration_ + 1);
    launch(++iteration_);
    settle(flights_[(iteration_ + 1) & 1]);
    smoothing_stale_ |= iteration_ % kFilterInterval == 0;
    refresh_smoothing();
    if (schedule_.averages_after(iteration_)) settle_average();
}

// The last iteration leaves the mean itself. Where there is no room for one the run goes on
// without.
void Trainer::settle_average() {
    drain();
    try {
        average_.add(splats_);
    } catch (const Error&) {
        if (average_.count() > 0) throw;
        average_.clear();
        mean_left_out_ = true;
        return;
    }
    planned_bytes_ = planned_bytes();
    if (iteration_ < options_.iterations) return;
    average_.swap(splats_);
    average_.clear();
}

void Trainer::drain() {
    settle(flights_[(iteration_ + 1) & 1]);
    settle(flights_[iteration_ & 1]);
}

void Trainer::reserve_backward() {
    backward_.reserve(splats_.count(), buffers_.size().intersections,
                      buffers_.frame().checkpoint_records());
}

void Trainer::launch(int iteration) {
    Flight& flight = flights_[iteration & 1];
    DARB_CHECK(flight.iteration == 0, "iteration {} is still in flight", flight.iteration);
    const int view = view_for(iteration);
    const gpu::CameraData& data = camera_data_of(view);
    const int width = static_cast<int>(data.width), height = static_cast<int>(data.height);
    const std::uint32_t pairs = std::max(buffers_.size().intersections, splats_.count() * 4);
    buffers_.reserve(splats_.count(), pairs, width, height);
    reserve_backward();
    note_memory();

    flight.iteration = iteration;
    flight.pixels = data.width * data.height;
    Commands& commands = flight.commands;
    commands.begin();
    AdamStep step = rates(iteration);
    step.clearance = static_cast<float>(options_.clearance * nearest_[view]);
    record(commands, view, iteration, degree_at(iteration), step, flight.loss);
    commands.copy(buffers_.frame().counters.status, flight.status, sizeof(gpu::FrameStatus));
    commands.submit();
}

FrameView Trainer::frame_view(int view, int degree, const glm::vec3& background) const {
    return {camera_data_of(view), &cameras_now(), static_cast<std::uint32_t>(view), degree,
            background};
}

void Trainer::record(Commands& commands, int view, int iteration, int degree, const AdamStep& step,
                     const Buffer& loss) {
    const FrameView seen = frame_view(view, degree, background_for(iteration));
    const gpu::CameraData& data = seen.camera;
    const Buffer& photo_pixels = pixels_of_photo(view);
    const std::uint32_t pixels = data.width * data.height;
    const std::uint32_t photo = photo_of(view);
    Frame& frame = buffers_.frame();
    const Buffer& image = frame.images.image;
    forward_.record(commands, splats_, seen, frame);
    if (exposure_) exposure_->record(commands, image, photo, pixels);
    const Buffer& compared = exposure_ ? exposure_->mapped() : image;
    if (scores(iteration))
        score_->record(commands, seen, frame, backward_, {compared, photo_pixels, d_image_},
                       splats_.count());
    loss_.record(commands, {compared, photo_pixels, d_image_, loss}, static_cast<int>(data.width),
                 static_cast<int>(data.height), seen.background, options_.lambda_dssim);
    if (exposure_) {
        const double rate = schedule_.exposure_rate(iteration);
        const int visits = (iteration - 1) / static_cast<int>(train_views_.size()) + 1;
        exposure_->record_backward(commands, image, d_image_, frame.counters.status, photo, pixels,
                                   static_cast<float>(rate), visits);
    }
    backward_.record(commands, seen, frame, splats_, d_image_, step);
    if (mcmc_) record_noise(commands, iteration);
}

gpu::FrameStatus Trainer::finish(Flight& flight) {
    flight.commands.wait();
    const int iteration = std::exchange(flight.iteration, 0);
    gpu::FrameStatus status;
    gpu::LossResult loss;
    std::memcpy(&status, flight.status.mapped(), sizeof status);
    std::memcpy(&loss, flight.loss.mapped(), sizeof loss);
    if (status.overflow != 0) return status;

    for (size_t r = 0; r < counters_.culled.size(); ++r) counters_.culled[r] += status.culled[r];
    counters_.bad_gradients += status.bad_gradients;
    counters_.longest_list = std::max(counters_.longest_list, status.longest_list);
    counters_.huge_splats = std::max(counters_.huge_splats, status.huge_splats);
    counters_.most_pairs = std::max(counters_.most_pairs, status.pairs);
    buffers_.note_status(status);
    check_gradients(iteration, status);
    for (const PassTime& pass : flight.commands.pass_times()) {
        const auto known = std::find_if(pass_totals_.begin(), pass_totals_.end(),
                                        [&](const PassTotal& p) { return p.name == pass.name; });
        if (known == pass_totals_.end())
            pass_totals_.push_back({pass.name, pass.ms});
        else
            known->ms += pass.ms;
    }
    ++timed_iterations_;
    if (on_result) {
        const double mse = std::max(double(loss.mse) / std::max(double(loss.weight), 1e-12), 1e-12);
        on_result({iteration, Loss::value(loss, options_.lambda_dssim), -10.0 * std::log10(mse),
                   splats_.count(), status.visible, status.pairs, flight.pixels,
                   static_cast<int>(GpuSplats::strides(splats_.sh_degree())[kShRest])});
    }
    return status;
}

// The overflow flag is sticky: whatever was submitted after the iteration that overflowed changed
// nothing either, and all of it is done again in order.
void Trainer::settle(Flight& flight) {
    if (flight.iteration == 0) return;
    const int first = flight.iteration;
    gpu::FrameStatus status = finish(flight);
    if (status.overflow == 0) return;
    for (Flight& later : flights_)
        if (std::exchange(later.iteration, 0) != 0) later.commands.wait();
    for (int i = first; i <= iteration_; ++i) {
        do {
            counters_.overflows += status.overflow != 0 ? 1 : 0;
            ++counters_.redone_iterations;
            buffers_.make_room(status, [this] { reserve_backward(); });
            launch(i);
            status = finish(flights_[i & 1]);
        } while (status.overflow != 0);
    }
}

void Trainer::check_gradients(int iteration, const gpu::FrameStatus& status) const {
    const std::uint64_t splats = std::max<std::uint64_t>(splats_.count(), kBadGradientShare);
    if (status.bad_gradients * kBadGradientShare <= splats) return;
    throw Error(fmt::format("iteration {}", iteration),
                fmt::format("the gradients of {} of {} splats are not finite, more than 1 in {}",
                            status.bad_gradients, splats_.count(), kBadGradientShare),
                "The last checkpoint is intact. Check the device (darb check), then the photos and "
                "the learning rates.");
}

void Trainer::density_control(int iteration) {
    if (iteration >= schedule_.rounds.end) return;
    const bool round = schedule_.refines_after(iteration);
    const bool reset = schedule_.resets_after(iteration);
    if (!round && !reset) return;
    drain();
    if (round) {
        gpu::DensifyArgs args{};
        const std::uint32_t within_memory = splats_within_memory();
        const bool pairs_are_near =
            counters_.most_pairs > kMostPairs * FrameBuffers::max_intersections(*device_);
        if (pairs_are_near && stopped_by_pairs_ == 0) stopped_by_pairs_ = splats_.count();
        const std::uint32_t limit =
            std::min({options_.max_splats.value_or(kAnyNumberOfSplats), within_memory,
                      GpuSplats::max_count(*device_, options_.sh_degree, true),
                      pairs_are_near ? splats_.count() : 0xFFFFFFFFu});
        args.gradient_threshold = options_.densify_grad_threshold;
        const double length = schedule_.length_scale * extent_;
        args.clone_split_scale = static_cast<float>(options_.clone_split_extent * length);
        args.prune_opacity = schedule_.prune_opacity;
        args.prune_scale = schedule_.prunes_by_size(iteration)
                               ? static_cast<float>(options_.prune_extent * length)
                               : 0.0f;
        args.seed = static_cast<std::uint32_t>(options_.seed * 0x9E3779B9u + iteration);
        const DensityResult result = refine(iteration, args, limit);
        if (within_memory == limit && result.after >= within_memory)
            stopped_by_memory_ = within_memory;
        counters_.cloned_or_split += result.grown;
        counters_.pruned += result.pruned;
        if (result.grown > 0 || result.pruned > 0) note_round(result.before);
        smoothing_stale_ |= result.grown > 0 || result.pruned > 0;
        settle_order();
        backward_.reserve(splats_.count(), 0);
        Commands& commands = flights_[0].commands;
        commands.begin();
        backward_.clear_gradient_sum(commands);
        commands.submit_and_wait();
    }
    if (reset) density_.reset_opacity(splats_, schedule_.resets.to);
}

SplatModel Trainer::model() {
    drain();
    average_.swap(splats_);
    const SplatModel model = splats_.download();
    average_.swap(splats_);
    if (!smoothing_ || model.size() == 0) return model;
    return bake_smoothing(model, splats_.smoothing().download<float>(model.size()));
}

std::map<std::string, ColourMap> Trainer::exposures() {
    std::map<std::string, ColourMap> named;
    if (!exposure_) return named;
    drain();
    const std::vector<ColourMap> maps = exposure_->maps();
    for (size_t p = 0; p < maps.size(); ++p) named[names_[train_views_[p]]] = maps[p];
    return named;
}

ImageF Trainer::render(const Camera& camera) {
    drain();
    FrameView view{camera_data(camera, splats_.origin()), nullptr, 0, sh_degree(), background_};
    const Buffer cameras = upload_cameras(*device_, {view.camera});
    view.cameras = &cameras;
    Frame& frame = buffers_.frame();
    Commands& commands = flights_[0].commands;
    const std::uint32_t pairs = std::max(buffers_.size().intersections, splats_.count() * 4);
    buffers_.reserve(splats_.count(), pairs, camera.width, camera.height);
    average_.swap(splats_);
    do {
        commands.begin();
        forward_.record(commands, splats_, view, frame);
        commands.submit_and_wait();
    } while (buffers_.make_room(frame.read_status(), [this] { reserve_backward(); }));
    average_.swap(splats_);
    return planes_to_image(
        frame.images.image.download<float>(size_t(camera.width) * camera.height * 3), camera.width,
        camera.height);
}

Trainer::State Trainer::state() {
    State s;
    drain();
    s.model = splats_.download();
    s.iteration = iteration_;
    s.next_probe = next_probe_;
    if (smoothing_) s.smoothing = splats_.smoothing().download<float>(splats_.count());
    if (exposure_) s.exposure = exposure_->state();
    if (score_) s.error_shares = score_->state(splats_.count());
    for (int a = 0; a < kAttributeCount; ++a) {
        const size_t floats = size_t{splats_.count()} * splats_.stride(a) * 2;
        s.moments.push_back(floats ? splats_.moments(a).download<float>(floats)
                                   : std::vector<float>{});
    }
    const size_t rest = size_t{splats_.count()} * splats_.stride(kShRest);
    if (splats_.has_rest_sum() && rest > 0) s.rest_sum = splats_.rest_sum().download<float>(rest);
    s.gradient_sum = backward_.gradient_sum()
                         ? backward_.gradient_sum().download<float>(size_t{splats_.count()} * 2)
                         : std::vector<float>(size_t{splats_.count()} * 2);
    s.mean = average_.state(splats_);
    s.averaged = average_.count();
    s.counters = counters_;
    return s;
}

void Trainer::restore(const State& s) {
    drain();
    splats_ = GpuSplats();  // first, so that there are never two
    splats_ = GpuSplats(*device_, s.model, true, schedule_.rest_every > 1);
    if (s.next_probe > 0) next_probe_ = s.next_probe;
    if (smoothing_) {
        update_smoothing();
        if (!s.smoothing.empty()) splats_.smoothing().upload(s.smoothing);
    }
    if (exposure_ && !s.exposure.empty()) exposure_->restore(s.exposure);
    for (int a = 0; a < kAttributeCount; ++a)
        if (!s.moments[a].empty()) splats_.moments(a).upload(s.moments[a]);
    if (!s.rest_sum.empty()) splats_.rest_sum().upload(s.rest_sum);
    backward_.reserve(splats_.count(), 0);
    if (!s.gradient_sum.empty()) backward_.gradient_sum().upload(s.gradient_sum);
    average_.restore(s.mean, s.averaged);
    iteration_ = s.iteration;
    counters_ = s.counters;
    if (score_) {
        score_->reset(splats_.count());
        if (!s.error_shares.empty()) score_->restore(s.error_shares);
    }
    settle_resolution(std::max(iteration_, 1));
}

}  // namespace darb
