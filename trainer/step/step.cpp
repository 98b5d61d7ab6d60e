// SPDX-License-Identifier: MIT
#include "trainer/step/step.h"

#include <algorithm>
#include <cstring>

#include "engine/core/error.h"
#include "engine/primitives/groups.h"
#include "engine/render/render_gradients.h"
#include "engine/render/renderer.h"
#include "shaders/shared/loss_args.h"
#include "shaders/shared/render_args.h"

namespace darb {

DepthLoss::DepthLoss(Device& device, const DepthLossOptions& options)
    : pipeline_(device, "depth_loss",
                {{"THREADS", SPLAT_GROUP},
                 {"USE_ALPHA", options.use_alpha ? 1 : 0},
                 {"ADD", options.exposure ? 1 : 0},
                 {"MEASURED", options.measured ? 1 : 0},
                 {"DEPTH_SUM", 1},
                 {"DEPTH_SPREAD", options.spread ? 1 : 0}}) {}

void DepthLoss::record(Commands& commands, const DepthLossBuffers& buffers, std::uint32_t pixels,
                       const DepthLossWeights& weights) {
    commands.pass("depth loss");
    const Groups g = groups_for(pixels);
    const auto scale =
        static_cast<float>(weights.measured / (static_cast<double>(pixels) * weights.usual));
    const float distortion_scale = weights.distortion / static_cast<float>(pixels);
    commands.dispatch(
        pipeline_, gpu::DepthLossArgs{pixels, buffers.measured ? 1u : 0u, scale, distortion_scale},
        {buffers.image, buffers.transmittance, buffers.photo, buffers.d_image}, g.x, g.y);
}

ForwardOptions forward_options(const TrainOptions& options) {
    ForwardOptions f;
    f.kernel = options.kernel;
    f.footprint = options.footprint;
    set_options(options.accuracy, f);
    f.effects = options.projection;
    f.effects.antialias = f.effects.smoothing = options.antialias;
    f.huge_splat_path = options.huge_splat_path;
    f.store_for_backward = true;
    f.camera_gradient = options.refine_cameras;
    f.alpha_gradient = options.exposure;
    f.depth_spread = options.surface && options.distortion_weight > 0;
    f.depth_sum = options.depth || f.depth_spread;
    return f;
}

namespace {

ExposureStep exposure_step(const StepInput& input) {
    return {input.view.exposure, input.view.size(), input.exposure_rate, input.exposure_visits};
}

}  // namespace

bool steps_by_views(const TrainOptions& options) {
    return options.batch > 1 || options.refine_cameras;
}

bool compares_depth(const TrainOptions& options, const View& view) {
    return options.depth && !view.depth.empty();
}

LossOptions loss_options(const TrainOptions& options, const Dataset& dataset) {
    return {.use_alpha = options.alpha, .use_mask = options.alpha && dataset.alpha_is_mask};
}

TrainingStep::Flight::Flight(Device& device)
    : loss(device, "loss result", sizeof(gpu::LossResult), Memory::host),
      status(device, "status result", sizeof(gpu::FrameStatus), Memory::host),
      commands(device) {}

TrainingStep::TrainingStep(Device& device, GpuSplats& splats, TrainingPhotos& photos,
                           const LossOptions& loss, const TrainOptions& options)
    : device_(&device),
      splats_(&splats),
      photos_(&photos),
      buffers_(device, forward_options(options)),
      forward_(device, forward_options(options)),
      backward_(device, forward_options(options)),
      loss_(device, photos.largest_width(), photos.largest_height(), loss),
      lambda_dssim_(options.dssim_weight()),
      depth_weight_(options.depth_weight),
      d_image_(device, "d_image",
               photos.largest_photo() * 4 * d_image_planes(forward_options(options))),
      flights_{Flight(device), Flight(device)} {
    if (options.exposure)
        exposure_.emplace(device, exposure_maps(options, photos.exposures()),
                          photos.largest_photo());
    const ForwardOptions forward = forward_options(options);
    if (forward.depth_sum)
        depth_.emplace(device, DepthLossOptions{loss.use_alpha, options.exposure, options.depth,
                                                forward.depth_spread});
    if (steps_by_views(options)) adam_.emplace(device);
    if (options.refine_cameras) cameras_.emplace(device);
    if (options.learn_kernel > 0) profile_.emplace(device, forward_options(options));
}

void TrainingStep::set_kernel(int kernel) {
    drain();
    forward_.set_kernel(kernel);
    backward_.set_kernel(kernel);
    if (profile_) profile_->set_kernel(kernel);
}

void TrainingStep::set_shutter(bool rolls) {
    drain();
    ForwardOptions options = forward_.options();
    if (options.effects.shutter == rolls) return;
    options.effects.shutter = rolls;
    forward_ = Forward(*device_, options);
    backward_ = Backward(*device_, options);
}

void TrainingStep::reserve(int width, int height) {
    const std::uint32_t room = std::max(buffers_.size().intersections, splats_->count() * 4);
    buffers_.reserve(splats_->count(), room, width, height);
}

void TrainingStep::reserve_backward() {
    backward_.reserve(splats_->count(), buffers_.size().intersections,
                      buffers_.frame().checkpoint_records());
    if (cameras_) cameras_->reserve(buffers_.size().splats);
    if (profile_) profile_->reserve(buffers_.size());
}

bool TrainingStep::make_room(const gpu::FrameStatus& status) {
    return buffers_.make_room(status, [this] { reserve_backward(); });
}

void TrainingStep::run(const StepInput& input) {
    if (picture_gradient) drain();
    Flight& flight = flights_[input.iteration & 1];
    launch(flight, input);
    complete(flights_[(input.iteration + 1) & 1]);
}

void TrainingStep::drain() {
    const bool in_order = flights_[0].input.iteration < flights_[1].input.iteration;
    complete(flights_[in_order ? 0 : 1]);
    complete(flights_[in_order ? 1 : 0]);
}

void TrainingStep::launch(Flight& flight, const StepInput& input) {
    DARB_CHECK(!flight.busy, "iteration {} is still in flight", flight.input.iteration);
    reserve(input.view.width(), input.view.height());
    reserve_backward();
    if (on_reserved) on_reserved();
    flight.input = input;
    if (picture_gradient) ask_for_gradient(flight);
    flight.busy = true;
    flight.commands.begin();
    const StepInput placed = with_photo(flight.commands, input);
    if (!picture_gradient) record_picture(flight.commands, placed);
    if (picture_gradient)
        flight.commands.copy(given_d_image_, d_image_, std::uint64_t{input.view.size()} * 12);
    else
        record_loss(flight.commands, placed, flight.loss);
    record_back(flight.commands, placed);
    flight.commands.copy(buffers_.frame().counters.status, flight.status, sizeof(gpu::FrameStatus));
    flight.commands.submit();
    photos_->submitted();
}

// The input of what is recorded next, which reads the photo where it is placed.
StepInput TrainingStep::with_photo(Commands& commands, const StepInput& input) {
    StepInput placed = input;
    placed.view.pixels = &photos_->place(commands, input.view, input.next_view);
    return placed;
}

StepFrame TrainingStep::step_frame(Commands& commands, const StepInput& input) {
    return {commands, *splats_, buffers_.frame().counters.status, input.iteration};
}

ExposedPicture TrainingStep::exposed(const TrainingView& view) {
    const FrameImages& images = buffers_.frame().images;
    return {images.image, images.final_transmittance, view.frame.background,
            view.frame.camera.width};
}

void TrainingStep::record_picture(Commands& commands, const StepInput& input) {
    const TrainingView& view = input.view;
    Frame& frame = buffers_.frame();
    forward_.record(commands, *splats_, view.frame, frame);
    if (exposure_) exposure_->record(commands, exposed(view), view.exposure, view.size());
}

void TrainingStep::record_loss(Commands& commands, const StepInput& input, const Buffer& loss) {
    const TrainingView& view = input.view;
    const Buffer& compared = exposure_ ? exposure_->mapped() : buffers_.frame().images.image;
    loss_.record(commands, {compared, *view.pixels, d_image_, loss}, view.width(), view.height(),
                 view.frame.background, lambda_dssim_);
}

void TrainingStep::record_back(Commands& commands, const StepInput& input) {
    const TrainingView& view = input.view;
    Frame& frame = buffers_.frame();
    const Buffer& status = frame.counters.status;
    if (exposure_)
        exposure_->record_backward(commands, exposed(view), d_image_, exposure_step(input),
                                   input.place);
    if (depth_)
        depth_->record(commands,
                       {frame.images.image, frame.images.final_transmittance, *view.pixels,
                        d_image_, view.measured},
                       view.size(),
                       {depth_weight_, photos_->usual_depth(), input.distortion_weight});
    if (input.samples_profile) profile_->record(commands, view.frame, frame, d_image_);
    if (input.gradients) {
        backward_.record_gradients(
            commands, view.frame, frame, *splats_, d_image_,
            {*input.gradients, false, cameras_ ? &cameras_->shares() : nullptr});
        if (cameras_) cameras_->record(commands, splats_->count(), input.gradients->of(kPosition));
        return;
    }
    if (exposure_) exposure_->record_step(commands, status, exposure_step(input));
    backward_.record(commands, view.frame, frame, *splats_, d_image_, input.adam);
    if (input.strategy) input.strategy->record_after_update(step_frame(commands, input));
}

std::vector<PassTime> TrainingStep::work(const std::function<void(Commands&)>& record) {
    Commands& commands = flights_[0].commands;
    commands.begin();
    record(commands);
    commands.submit_and_wait();
    return commands.pass_times();
}

std::vector<PassTime> TrainingStep::run_update(std::span<const StepInput> views,
                                               const GradientBuffers& sum) {
    reserve_backward();
    return work([&](Commands& commands) { record_update(commands, views, sum); });
}

void TrainingStep::record_update(Commands& commands, std::span<const StepInput> views,
                                 const GradientBuffers& sum) {
    const StepInput& last = views.back();
    const Buffer& status = buffers_.frame().counters.status;
    adam_->record(commands, *splats_, sum, status, last.view.frame.sh_degree, last.adam,
                  1.0f / static_cast<float>(views.size()));
    for (const StepInput& input : views)
        adam_->record_fading(commands, *splats_, sum, status, input.view.frame,
                             input.adam.clearance);
    adam_->record_sums(commands, sum, status, backward_.gradient_sum());
    if (exposure_)
        for (const StepInput& input : views)
            exposure_->record_step(commands, status, exposure_step(input), input.place);
    if (last.strategy) last.strategy->record_after_update(step_frame(commands, last));
}

// A frame that did not fit is drawn again before anybody sees it: the step behind it then fits.
void TrainingStep::ask_for_gradient(Flight& flight) {
    const TrainingView& view = flight.input.view;
    do {
        flight.commands.begin();
        const StepInput placed = with_photo(flight.commands, flight.input);
        record_picture(flight.commands, placed);
        record_loss(flight.commands, placed, flight.loss);
        flight.commands.submit_and_wait();
        photos_->submitted();
    } while (make_room(buffers_.frame().read_status()));
    const Buffer& compared = exposure_ ? exposure_->mapped() : buffers_.frame().images.image;
    const size_t floats = 3 * size_t{view.size()};
    const ImageF d_picture = picture_gradient(
        planes_to_image(compared.download<float>(floats), view.width(), view.height()),
        flight.input);
    std::vector<float> planes = gradient_planes(d_picture, {}, view.width(), view.height());
    planes.resize(floats);
    if (given_d_image_.bytes() < floats * sizeof(float))
        given_d_image_ = Buffer(*device_, "d_image of the caller", floats * sizeof(float));
    given_d_image_.upload(planes);
}

// Where the step overflowed it changed nothing and tells nothing.
gpu::FrameStatus TrainingStep::read(Flight& flight, StepOutcome& outcome) {
    flight.commands.wait();
    flight.busy = false;
    gpu::LossResult loss;
    std::memcpy(&outcome.status, flight.status.mapped(), sizeof outcome.status);
    std::memcpy(&loss, flight.loss.mapped(), sizeof loss);
    if (outcome.status.overflow != 0) return outcome.status;
    buffers_.note_status(outcome.status);
    outcome.iteration = flight.input.iteration;
    outcome.loss = Loss::value(loss, lambda_dssim_);
    outcome.mse = double(loss.mse) / std::max(double(loss.weight), 1e-12);
    outcome.pixels = flight.input.view.size();
    outcome.passes = flight.commands.pass_times();
    if (cameras_ && flight.input.gradients) outcome.camera = cameras_->read();
    return outcome.status;
}

gpu::FrameStatus TrainingStep::finish(Flight& flight, StepOutcome& outcome) {
    const gpu::FrameStatus status = read(flight, outcome);
    if (status.overflow == 0 && on_finished) on_finished(outcome);
    return status;
}

StepOutcome TrainingStep::run_view(const StepInput& input) {
    drain();
    StepOutcome outcome;
    for (;;) {
        launch(flights_[0], input);
        const gpu::FrameStatus status = read(flights_[0], outcome);
        if (status.overflow == 0) return outcome;
        ++outcome.overflows;
        ++outcome.redone;
        make_room(status);
    }
}

// The overflow flag is sticky: whatever was submitted after the step that overflowed changed
// nothing either.
void TrainingStep::complete(Flight& flight) {
    if (!flight.busy) return;
    StepOutcome outcome;
    gpu::FrameStatus status = finish(flight, outcome);
    if (status.overflow == 0) return;
    std::vector<StepInput> undone{flight.input};
    for (Flight& later : flights_) {
        if (!later.busy) continue;
        later.commands.wait();
        later.busy = false;
        undone.push_back(later.input);
    }
    for (const StepInput& input : undone) status = redo(input, status);
}

// status: of the frame before, which says for how much there must be room.
gpu::FrameStatus TrainingStep::redo(const StepInput& input, gpu::FrameStatus status) {
    StepOutcome outcome;
    do {
        outcome.overflows += status.overflow != 0 ? 1 : 0;
        ++outcome.redone;
        make_room(status);
        Flight& flight = flights_[input.iteration & 1];
        launch(flight, input);
        status = finish(flight, outcome);
    } while (status.overflow != 0);
    return status;
}

ImageF TrainingStep::render(const Camera& camera, int sh_degree, const glm::vec3& background) {
    FrameView view{camera_data(camera, splats_->origin()), nullptr, 0, sh_degree, background};
    const Buffer cameras = upload_cameras(*device_, {view.camera});
    view.cameras = &cameras;
    Commands& commands = flights_[0].commands;
    Frame& frame = buffers_.frame();
    reserve(camera.width, camera.height);
    do {
        commands.begin();
        forward_.record(commands, *splats_, view, frame);
        commands.submit_and_wait();
    } while (make_room(frame.read_status()));
    return planes_to_image(
        frame.images.image.download<float>(size_t(camera.width) * camera.height * 3), camera.width,
        camera.height);
}

double TrainingStep::photo_mse(const TrainingView& view) {
    Flight& flight = flights_[0];
    Frame& frame = buffers_.frame();
    const Buffer& image = frame.images.image;
    reserve(view.width(), view.height());
    do {
        flight.commands.begin();
        const Buffer& photo = photos_->place(flight.commands, view);
        forward_.record(flight.commands, *splats_, view.frame, frame);
        if (exposure_)
            exposure_->record(flight.commands, exposed(view), view.exposure, view.size());
        loss_.record(flight.commands,
                     {exposure_ ? exposure_->mapped() : image, photo, d_image_, flight.loss},
                     view.width(), view.height(), view.frame.background, lambda_dssim_);
        flight.commands.submit_and_wait();
        photos_->submitted();
    } while (make_room(frame.read_status()));
    gpu::LossResult loss;
    std::memcpy(&loss, flight.loss.mapped(), sizeof loss);
    return double(loss.mse) / std::max(double(loss.weight), 1e-12);
}

std::vector<float> TrainingStep::gradient_sum_values() {
    const size_t floats = size_t{splats_->count()} * 2;
    if (!backward_.gradient_sum()) return std::vector<float>(floats);
    return backward_.gradient_sum().download<float>(floats);
}

void TrainingStep::restore_gradient_sum(const std::vector<float>& values) {
    backward_.reserve(splats_->count(), 0);
    if (!values.empty()) backward_.gradient_sum().upload(values);
}

void TrainingStep::clear_gradient_sum() {
    backward_.reserve(splats_->count(), 0);
    Commands& commands = flights_[0].commands;
    commands.begin();
    backward_.clear_gradient_sum(commands);
    commands.submit_and_wait();
}

namespace {
// More splats than this share with a gradient that is not finite: something is broken.
constexpr std::uint64_t kBadGradientShare = 1'000;
}  // namespace

void RunTotals::count(const StepOutcome& outcome) {
    const gpu::FrameStatus& status = outcome.status;
    counters.redone_iterations += outcome.redone;
    counters.overflows += outcome.overflows;
    for (size_t r = 0; r < counters.culled.size(); ++r) counters.culled[r] += status.culled[r];
    counters.bad_gradients += status.bad_gradients;
    counters.longest_list = std::max(counters.longest_list, status.longest_list);
    counters.huge_splats = std::max(counters.huge_splats, status.huge_splats);
    counters.most_intersections = std::max(counters.most_intersections, status.intersections);
}

void RunTotals::add_times(const StepOutcome& outcome) {
    for (const PassTime& pass : outcome.passes) {
        const auto known = std::find_if(passes.begin(), passes.end(),
                                        [&](const PassTotal& p) { return p.name == pass.name; });
        if (known == passes.end())
            passes.push_back({pass.name, pass.ms});
        else
            known->ms += pass.ms;
    }
    ++timed_iterations;
}

void check_gradients(const StepOutcome& outcome, std::uint32_t splat_count) {
    const std::uint64_t bad = outcome.status.bad_gradients;
    const std::uint64_t splats = std::max<std::uint64_t>(splat_count, kBadGradientShare);
    if (bad * kBadGradientShare <= splats) return;
    throw Error(fmt::format("iteration {}", outcome.iteration),
                fmt::format("the gradients of {} of {} splats are not finite, more than 1 in {}",
                            bad, splat_count, kBadGradientShare),
                "The last checkpoint is intact. Check the device (darb check), then the photos and "
                "the learning rates.");
}

}  // namespace darb
