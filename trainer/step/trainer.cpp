// SPDX-License-Identifier: MIT
#include "trainer/step/trainer.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/rng.h"
#include "engine/core/scope_guard.h"
#include "trainer/step/batch_step.h"
#include "trainer/step/checkpoint.h"

namespace darb {

namespace {

constexpr int kStepsApart = 64;  // that mixed devices take between two looks at the first
// in half sides of the grid: a cell is 1/128 of the scene's extent
constexpr float kGridExtents = 4;

SplatModel start_model(SplatModel start, const TrainOptions& options) {
    start.antialias = options.antialias;
    if (options.probe_sh) {
        start.sh_degree = 0;
        start.sh_rest.clear();
    }
    return start;
}

// Before anything of the run is there.
Device& with_budget(Device& device, const TrainOptions& options) {
    if (options.max_memory_bytes) device.set_memory_budget(*options.max_memory_bytes);
    return device;
}

double psnr_of(double mse) {
    return -10.0 * std::log10(std::max(mse, 1e-12));
}

// The last iteration of (begin, end] for which it holds; 0: none.
template <class Holds>
int last_in(int begin, int end, Holds holds) {
    for (int i = end; i > begin; --i)
        if (holds(i)) return i;
    return 0;
}

// While it is there, the parameters are the mean, where there is one.
class ShownMean {
  public:
    ShownMean(IterateAverage& average, GpuSplats& splats) : average_(average), splats_(splats) {
        average_.swap(splats_);
    }
    ~ShownMean() { average_.swap(splats_); }
    ShownMean(const ShownMean&) = delete;
    ShownMean& operator=(const ShownMean&) = delete;

  private:
    IterateAverage& average_;
    GpuSplats& splats_;
};

}  // namespace

Trainer::Trainer(Device& device, const Dataset& dataset, const std::vector<ImageU8>& photos,
                 const SplatModel& start, const Schedule& schedule, RankGroup ranks,
                 std::uint32_t frozen)
    : device_(&with_budget(device, schedule.options)),
      ranks_(ranks.all ? ranks : RankGroup{&alone_}),
      schedule_(schedule),
      extent_(scene_extent(dataset)),
      alpha_is_mask_(dataset.alpha_is_mask),
      memory_(device, dataset, schedule, static_cast<std::uint32_t>(start.size())),
      splats_(device, start_model(start, schedule.options), true, schedule_.rest_every > 1),
      photos_(device, dataset, photos, splats_.origin(), memory_.streams_photos(),
              schedule.options.depth),
      order_(photos_.views(), schedule.options.seed),
      optimizer_(schedule, extent_, scene_reach(dataset), photos_.count()),
      density_(device, schedule.options.kernel, schedule.options.footprint),
      strategy_(strategy_row(schedule.options.strategy).make({device, schedule_, extent_})),
      average_(device),
      degree_probe_(schedule),
      shutter_probe_(schedule),
      step_(device, splats_, photos_, loss_options(schedule.options, dataset), schedule.options) {
    check_batch(*ranks_.all, schedule.options.batch);
    splats_.freeze(frozen);
    step_.on_finished = [this](const StepOutcome& outcome) { finish(outcome); };
    step_.on_reserved = [this] { memory_.record(held()); };
    if (schedule.options.antialias)
        smoothing_.emplace(device, forward_options(schedule.options).effects,
                           photos_.training_cameras());
    if (schedule.options.morton_order) morton_.emplace(device);
    if (schedule.options.refine_cameras) cameras_.emplace(dataset, schedule.options);
    if (steps_by_views(schedule.options)) tree_.emplace(device, schedule.options.batch);
    if (schedule.options.learn_kernel > 0) {
        profile_.emplace(schedule.options.kernel, schedule.options.footprint,
                         schedule.options.kernel_lr);
        use_kernel(profile_->kernel());
    }
    set_resolution(1);
    update_smoothing();
    step_.reserve(photos_.largest_width(), photos_.largest_height());
}

void Trainer::reschedule(const Schedule& next) {
    drain();
    schedule_ = next;
    optimizer_.set_schedule(next);
    memory_.set_schedule(next);
    degree_probe_.set_schedule(next);
    shutter_probe_.set_schedule(next);
    if (cameras_) cameras_->set_iterations(next.options.iterations);
    strategy_ = strategy_row(next.options.strategy).make({*device_, schedule_, extent_});
    strategy_->set_kernel(splats_.kernel());
    device_->set_memory_budget(next.options.max_memory_bytes.value_or(0));
}

int Trainer::degree_at(int iteration) const {
    return schedule_.options.probe_sh ? splats_.sh_degree() : schedule_.sh_degree(iteration);
}

glm::vec3 Trainer::background_for(int iteration) const {
    if (!schedule_.options.random_background) return background();
    Pcg32 random(schedule_.options.seed,
                 0x6261636Bull << 32 | static_cast<std::uint32_t>(iteration));
    glm::vec3 colour;
    for (int c = 0; c < 3; ++c) colour[c] = static_cast<float>(random.uniform());
    return colour;
}

// Each photo is visited once in a round of them, but the faces of a panorama share an exposure.
int Trainer::exposure_visits(int iteration, std::uint32_t exposure) {
    if (photos_.exposures() == photos_.count())
        return (iteration - 1) / static_cast<int>(photos_.count()) + 1;
    const std::vector<int>& views = photos_.views();
    return std::max(1, order_.visits(iteration, [&](int view) {
        const auto photo = std::ranges::lower_bound(views, view) - views.begin();
        return photos_.exposure(static_cast<std::size_t>(photo)) == exposure;
    }));
}

// last: of the step, whose rates and degree all of its views have.
StepInput Trainer::input_for(int iteration, int view, int last) {
    StepInput input;
    input.iteration = iteration;
    input.view = photos_.view(view, degree_at(last), background_for(iteration));
    input.adam = optimizer_.step(last);
    input.adam.clearance =
        static_cast<float>(schedule_.options.clearance * photos_.nearest_distance(view));
    input.adam.splats_gone = totals_.counters.undrawn;
    input.exposure_rate = static_cast<float>(schedule_.exposure_rate(iteration));
    if (schedule_.lays_on_surfaces(iteration))
        input.distortion_weight = schedule_.options.distortion_weight;
    input.exposure_visits = exposure_visits(iteration, input.view.exposure);
    input.strategy = strategy_.get();
    return input;
}

// Density control opens the next step rather than closing its own, so that what is evaluated and
// saved between them is what was trained, not what was just reset.
void Trainer::step() {
    if (turns_.opened != iteration_) open_step();
    if (ranks_.mixed && iteration_ / schedule_.options.batch % kStepsApart == 0) follow_first();
    set_resolution(iteration_ + 1);
    const int begin = iteration_;
    tree_ ? run_batch() : run_step();
    if (smoothing_) smoothing_->advance(begin, iteration_);
    update_smoothing();
    if (last_in(begin, iteration_, [&](int i) { return schedule_.averages_after(i); })) average();
}

void Trainer::run_step() {
    StepInput input = input_for(iteration_ + 1, order_.view(iteration_ + 1), iteration_ + 1);
    input.samples_profile = schedule_.samples_kernel_at(iteration_ + 1);
    if (photos_.stream()) input.next_view = order_.view(iteration_ + 2);
    if (step_.picture_gradient) step_.run(input);
    ++iteration_;
    if (!step_.picture_gradient) step_.run(input);
}

void Trainer::run_batch() {
    const int end = schedule_.step_end(iteration_);
    std::vector<StepInput> views;
    for (int i = iteration_ + 1; i <= end; ++i) {
        views.push_back(input_for(i, order_.view(i), end));
        views.back().place = i - iteration_ - 1;
        views.back().samples_profile = views.back().place == 0 && schedule_.samples_kernel_at(i);
    }
    const std::vector<StepOutcome> outcomes =
        run_batch_step(step_, *tree_, splats_, views, *ranks_.all, schedule_.options.batch);
    iteration_ = end;
    if (cameras_) refine_cameras(iteration_, views, outcomes);
    for (const StepOutcome& outcome : outcomes) finish(outcome);
}

void Trainer::refine_cameras(int iteration, const std::vector<StepInput>& views,
                             const std::vector<StepOutcome>& outcomes, double share) {
    std::vector<CameraVisit> visits;
    for (std::size_t i = 0; i < views.size(); ++i) {
        const int view = static_cast<int>(views[i].view.frame.index);
        visits.push_back({view, camera_gradient(photos_.camera(view), outcomes[i].camera),
                          views[i].view.width(), views[i].view.height()});
    }
    if (cameras_->step(iteration, visits, share)) place_cameras();
}

void Trainer::place_cameras() {
    std::vector<Camera> cameras;
    for (std::size_t v = 0; v < photos_.view_count(); ++v)
        cameras.push_back(cameras_->camera(static_cast<int>(v)));
    photos_.set_cameras(cameras);
}

std::optional<CameraMoves> Trainer::camera_moves() const {
    return cameras_ ? std::optional(cameras_->moves()) : std::nullopt;
}

void Trainer::open_step() {
    if (turns_.controlled != iteration_) {
        turns_.round = control_density();
        change_kernel();
    }
    turns_.controlled =
        iteration_;  // a probe that fails is tried again, the round before it is not
    update_smoothing();
    const bool degree = degree_probe_.is_due(iteration_, splats_.sh_degree());
    const bool shutter = cameras_ && !cameras_->shutters() && shutter_probe_.is_due(iteration_);
    if (degree) probe_degree();
    if (shutter) probe_shutter();
    turns_.opened = iteration_;
    const std::optional<DensityResult> round = std::exchange(turns_.round, std::nullopt);
    if ((round || degree || shutter) && ranks_.mixed) follow_first();
    if (round && on_round) on_round(iteration_, *round);
}

// The first rank has the first view of each batch, whose sums alone are taken.
void Trainer::change_kernel() {
    const int begin = schedule_.step_begin(iteration_);
    if (last_in(begin, iteration_, [&](int i) { return schedule_.changes_kernel_after(i); }) == 0)
        return;
    drain();
    std::vector<float> sums = step_.profile().read();
    if (ranks_.several()) {
        const auto bytes = std::as_bytes(std::span(sums));
        const Bytes first = from_first(*ranks_.all, Bytes(bytes.begin(), bytes.end()));
        std::memcpy(sums.data(), first.data(), std::min(first.size(), bytes.size()));
    }
    step_.profile().clear();
    profile_->step(sums);
    use_kernel(profile_->kernel());
}

// Lengths and rates stay those of the kernel at the start, as psi does.
void Trainer::use_kernel(int kernel) {
    if (kernel == splats_.kernel()) return;
    drain();
    splats_.set_kernel(kernel);
    step_.set_kernel(kernel);
    density_.set_kernel(kernel, schedule_.options.footprint);
    strategy_->set_kernel(kernel);
}

void Trainer::set_picture_gradient(std::function<ImageF(const TrainingPicture&)> gradient) {
    drain();
    step_.picture_gradient = nullptr;
    if (!gradient) return;
    step_.picture_gradient = [this, gradient = std::move(gradient)](const ImageF& picture,
                                                                    const StepInput& input) {
        const TrainingView& view = input.view;
        ImageU8 photo(view.width(), view.height(), 4);
        view.pixels->download(std::as_writable_bytes(std::span(photo.data)));
        return gradient({picture, photo, photos_.name(photos_.views()[view.photo]), input.iteration,
                         view.frame.background});
    };
}

void Trainer::finish(const StepOutcome& outcome) {
    totals_.count(outcome);
    check_gradients(outcome, splats_.count());
    totals_.add_times(outcome);
    if (!on_result) return;
    on_result({outcome.iteration, outcome.loss, psnr_of(outcome.mse), splats_.count(),
               outcome.status.visible, outcome.status.intersections, outcome.pixels,
               static_cast<int>(splats_.stride(kShRest)), outcome.ends_step});
}

// What is due after any iteration of the step comes once, as after the last of them.
std::optional<DensityResult> Trainer::control_density() {
    const int begin = schedule_.step_begin(iteration_);
    const int end = std::min(iteration_, schedule_.rounds.end - 1);
    const int round = last_in(begin, end, [&](int i) { return schedule_.refines_after(i); });
    const int reset = last_in(begin, end, [&](int i) { return schedule_.resets_after(i); });
    const bool drops =
        last_in(begin, iteration_, [&](int i) { return schedule_.drops_undrawn_after(i); }) > 0;
    if (round == 0 && reset == 0 && !drops) return std::nullopt;
    drain();
    std::optional<DensityResult> result;
    if (round > 0) result = run_round(round);
    if (round == 0 && drops) result = drop_undrawn();
    if (reset > 0) density_.reset_opacity(splats_, schedule_.resets.to);
    return result;
}

gpu::DensifyArgs Trainer::round_args(int iteration) const {
    gpu::DensifyArgs args{};
    args.gradient_threshold = schedule_.options.densify_grad_threshold;
    const double length = optimizer_.length();
    args.clone_split_scale = static_cast<float>(schedule_.options.clone_split_extent * length);
    args.prune_opacity = schedule_.prune_opacity;
    args.prune_scale = schedule_.prunes_by_size(iteration)
                           ? static_cast<float>(schedule_.options.prune_extent * length)
                           : 0.0f;
    args.seed = static_cast<std::uint32_t>(schedule_.options.seed * 0x9E3779B9u + iteration);
    return args;
}

// With devices that round differently, the splats of the first become everybody's again.
void Trainer::follow_first() {
    const int opened = turns_.opened, controlled = turns_.controlled;
    const Bytes bytes =
        ranks_.all->is_first() ? checkpoint_bytes({state(), "", "", 0, ""}) : Bytes{};
    const Bytes first = from_first(*ranks_.all, bytes);
    if (!ranks_.all->is_first()) restore(parse_checkpoint(first, "the first rank").state);
    turns_.opened = opened;
    turns_.controlled = controlled;
}

DensityResult Trainer::run_round(int iteration) {
    const std::uint32_t limit = least(*ranks_.all, memory_.growth_limit(held(), totals_.counters));
    const DensityResult result =
        strategy_->round({splats_, density_, step_.gradient_sum(), round_args(iteration), iteration,
                          limit, outside()});
    memory_.end_round(result.after);
    end_round(result);
    reorder();
    step_.clear_gradient_sum();
    return result;
}

// In double, by the one definition of what lies in a region. Rounds are few, and a round waits for
// the device anyway.
std::vector<std::uint8_t> Trainer::outside() const {
    const std::optional<Region>& region = schedule_.options.region;
    if (!region) return {};
    SplatModel places;
    places.origin = splats_.origin();
    places.resize(splats_.count());
    places.position = splats_.parameters(kPosition).download<float>(3 * places.size());
    return splats_outside(*region, places);
}

DensityResult Trainer::end_round(const DensityResult& result) {
    totals_.counters.cloned_or_split += result.grown;
    totals_.counters.pruned += result.pruned;
    if (result.grown > 0 || result.pruned > 0) {
        memory_.record_round(held(), result.before);
        if (smoothing_) smoothing_->mark_stale();
    }
    return result;
}

// What is below that opacity gets no gradient and never comes back; the regulariser takes it there
// once no photo holds it up. Pictures and the other splats keep their bits by this, but where the
// smoothing filter is found anew.
std::optional<DensityResult> Trainer::drop_undrawn() {
    const bool has_room = memory_.has_room_for_round(held());
    if (ranks_.several() ? least(*ranks_.all, has_room ? 1 : 0) == 0 : !has_room)
        return std::nullopt;
    gpu::DensifyArgs args{};
    args.gradient_threshold = std::numeric_limits<float>::max();
    args.prune_opacity = static_cast<float>(schedule_.undrawn_opacity);
    const DensityResult result = density_.run(splats_, step_.gradient_sum(), args, 0);
    if (result.pruned == 0) return std::nullopt;
    totals_.counters.undrawn += result.pruned;
    step_.clear_gradient_sum();
    return end_round(result);
}

void Trainer::reorder() {
    if (!morton_) return;
    morton_->run(splats_, density_,
                 {photos_.mean_centre(), kGridExtents * static_cast<float>(extent_)});
    memory_.record_round(held(), splats_.count());
    if (smoothing_) smoothing_->mark_stale();
}

// Both iterations under way end with the photos that they began with.
void Trainer::set_resolution(int iteration) {
    const int divisor = photos_.has_room_for_smaller()
                            ? schedule_.resolution_divisor(iteration, photos_.longest_side())
                            : 1;
    if (divisor == photos_.divisor()) return;
    drain();
    photos_.set_divisor(divisor);
}

void Trainer::update_smoothing() {
    if (!smoothing_ || !smoothing_->is_stale()) return;
    drain();
    smoothing_->update(splats_);
}

// The run goes on from what the probe makes of its state, or from that state where one of its steps
// throws, as a loss of the caller's may. probe sets what a step of the trial is.
void Trainer::fork(const std::function<void(State& tried, ProbeFork fork)>& probe) {
    State tried = state();
    // What a trial finishes is no result of the run.
    auto on_finished = std::exchange(step_.on_finished, [this](const StepOutcome& outcome) {
        check_gradients(outcome, splats_.count());
    });
    const ScopeGuard reports([&] { step_.on_finished = std::move(on_finished); });
    const ScopeGuard goes_on([&] {  // before that: it finishes what the trial left under way
        restore(tried);
        turns_.controlled = iteration_;
    });
    probe(tried,
          {.restore = [this](const State& start) { restore(start); },
           .step = {},
           .fit = {},
           .photo_psnr =
               [this](int view) {
                   drain();
                   return psnr_of(step_.photo_mse(photos_.view(view, sh_degree(), background())));
               }});
}

StepInput Trainer::trial_input(int iteration, int view, float share) {
    StepInput input = input_for(iteration, view, iteration);
    const AdamStep usual = input.adam;
    input.adam = optimizer_.trial_step(iteration, share);
    input.adam.clearance = usual.clearance;
    input.adam.splats_gone = usual.splats_gone;
    return input;
}

void Trainer::probe_degree() {
    bool has_room = memory_.has_room_for_degree(held(), splats_.sh_degree() + 1);
    if (ranks_.several()) has_room = least(*ranks_.all, has_room ? 1 : 0) == 1;
    fork([&](State& tried, ProbeFork trial) {
        trial.step = [this](int iteration, int view, float share) {
            step_.run(trial_input(iteration, view, share));
        };
        probed_.push_back(degree_probe_.run(tried, photos_.views(), has_room, trial));
    });
}

// One view a step, by every rank alike.
void Trainer::train_camera_trial(int iteration, int view, float share) {
    std::vector<StepInput> views{trial_input(iteration, view, share)};
    const std::vector<StepOutcome> outcomes =
        run_batch_step(step_, *tree_, splats_, views, alone_, 1);
    refine_cameras(iteration, views, outcomes, double{share});
    check_gradients(outcomes.back(), splats_.count());
}

// A photo set aside has a pose and a motion of its own, which nothing but the photo tells. So in
// both arms its camera is fitted to half of its rows, the splats as they are, and the other half
// judges.

// The gradients of a view by the error in some of its rows, for its camera.
StepOutcome Trainer::band_gradients(StepInput input, RowBands bands, double& squared) {
    auto given =
        std::exchange(step_.picture_gradient, [&](const ImageF& picture, const StepInput& of) {
            ImageU8 photo(of.view.width(), of.view.height(), 4);
            of.view.pixels->download(std::as_writable_bytes(std::span(photo.data)));
            BandError error = band_error(picture, photo, of.view.frame.background,
                                         schedule_.options.alpha && alpha_is_mask_, bands);
            squared = error.squared;
            return std::move(error.d_image);
        });
    const ScopeGuard back([&] { step_.picture_gradient = std::move(given); });
    tree_->reserve(splats_);
    tree_->begin();
    input.gradients = &tree_->leaf();
    return step_.run_view(input);
}

void Trainer::fit_camera(int iteration, int view, float share) {
    double squared = 0;
    const std::vector<StepInput> views{trial_input(iteration, view, share)};
    const StepOutcome outcome = band_gradients(views[0], RowBands::fitted, squared);
    refine_cameras(iteration, views, {outcome}, double{share});
}

double Trainer::judged_psnr(int view) {
    double squared = 0;
    band_gradients(input_for(iteration_ + 1, view, iteration_ + 1), RowBands::judged, squared);
    return psnr_of(squared);
}

void Trainer::probe_shutter() {
    fork([&](State& tried, ProbeFork trial) {
        trial.fit = [this](int iteration, int view, float share) {
            fit_camera(iteration, view, share);
        };
        trial.photo_psnr = [this](int view) { return judged_psnr(view); };
        trial.step = [this](int iteration, int view, float share) {
            train_camera_trial(iteration, view, share);
        };
        State rolling = tried;
        rolling.cameras = cameras_->with_shutters(tried.cameras);
        probed_.push_back(shutter_probe_.run(tried, rolling, photos_.views(), trial));
    });
}

// The last iteration leaves the mean itself. Where there is no room for one the run goes on
// without.
void Trainer::average() {
    drain();
    try {
        average_.add(splats_);
    } catch (const NoRoom&) {
        if (average_.count() > 0) throw;
        average_.clear();
        mean_left_out_ = true;
        return;
    }
    memory_.record_peak(held());
    if (iteration_ < schedule_.last) return;
    average_.swap(splats_);
    average_.clear();
}

HeldMemory Trainer::held() const {
    return {.splats = splats_.count(),
            .sh_degree = splats_.sh_degree(),
            .frame = step_.frame_size(),
            .averages = average_.count() > 0,
            .divisor = photos_.divisor(),
            .small_pixels = photos_.small_pixels(),
            .small_cameras = photos_.small_cameras()};
}

SplatModel Trainer::model() {
    drain();
    SplatModel model;
    {
        const ShownMean mean(average_, splats_);
        model = splats_.download();
    }
    if (!smoothing_ || model.size() == 0) return model;
    return bake_smoothing(model, splats_.smoothing().download<float>(model.size()));
}

std::map<std::string, ColourMap> Trainer::exposures() {
    std::map<std::string, ColourMap> named;
    if (!step_.exposure()) return named;
    drain();
    const std::vector<ColourMap> maps = step_.exposure()->maps();
    for (size_t p = 0; p < photos_.count(); ++p)
        named[photos_.name(photos_.views()[p])] = maps[photos_.exposure(p)];
    return named;
}

ImageF Trainer::render(const Camera& camera) {
    drain();
    const ShownMean mean(average_, splats_);
    return step_.render(camera, sh_degree(), background());
}

Trainer::State Trainer::state() {
    State s;
    drain();
    s.model = splats_.download();
    s.iteration = iteration_;
    s.next_probe = degree_probe_.next();
    if (smoothing_) s.smoothing = splats_.smoothing().download<float>(splats_.count());
    if (step_.exposure()) s.exposure = step_.exposure()->state();
    if (cameras_) s.cameras = cameras_->state();
    if (profile_) {
        s.profile = profile_->state();
        const std::vector<float> sums = step_.profile().read();
        s.profile.insert(s.profile.end(), sums.begin(), sums.end());
    }
    for (int a = 0; a < kAttributeCount; ++a) s.moments.push_back(splats_.download_moments(a));
    s.rest_sum = splats_.download_rest_sum();
    s.gradient_sum = step_.gradient_sum_values();
    s.mean = average_.state(splats_);
    s.averaged = average_.count();
    s.counters = totals_.counters;
    return s;
}

// s.profile; the splats that are there follow, so that those of the state are of the same kernel.
void Trainer::restore_profile(const std::vector<float>& state) {
    const auto own =
        static_cast<std::ptrdiff_t>(std::min(state.size(), ProfileOptimizer::kStateFloats));
    profile_->restore({state.begin(), state.begin() + own});
    step_.profile().write({state.begin() + own, state.end()});
    use_kernel(profile_->kernel());
}

void Trainer::restore(const State& s) {
    check_state(s);
    DARB_CHECK(s.model.origin == photos_.origin(), "splats of another origin than the cameras'");
    drain();
    if (step_.exposure() && !s.exposure.empty()) step_.exposure()->restore(s.exposure);
    if (profile_ && !s.profile.empty()) restore_profile(s.profile);
    const std::uint32_t frozen = splats_.frozen();
    if (cameras_ && !s.cameras.empty()) {
        cameras_->restore(s.cameras);
        step_.set_shutter(cameras_->shutters());
        place_cameras();
    }
    splats_ = GpuSplats();  // first, so that there are never two
    splats_ = GpuSplats(*device_, s.model, true, schedule_.rest_every > 1);
    splats_.freeze(frozen);
    if (profile_) splats_.set_kernel(profile_->kernel());
    degree_probe_.set_next(s.next_probe);
    if (smoothing_) {
        smoothing_->update(splats_);
        if (!s.smoothing.empty()) splats_.smoothing().upload(s.smoothing);
    }
    for (int a = 0; a < kAttributeCount; ++a)
        if (!s.moments[a].empty()) splats_.upload_moments(a, s.moments[a]);
    if (!s.rest_sum.empty()) splats_.upload_rest_sum(s.rest_sum);
    step_.restore_gradient_sum(s.gradient_sum);
    average_.restore(s.mean, s.averaged, splats_);
    iteration_ = s.iteration;
    turns_.opened = turns_.controlled = s.iteration > 0 ? -1 : 0;
    totals_.counters = s.counters;
    set_resolution(std::max(iteration_, 1));
}

}  // namespace darb
