// SPDX-License-Identifier: MIT
#include "trainer/run/forecast.h"

#include <fmt/format.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <limits>
#include <string>

#include "engine/core/error.h"
#include "engine/core/memory.h"
#include "engine/core/rng.h"
#include "engine/core/scope_guard.h"
#include "engine/core/system.h"
#include "engine/raster/gpu_splats.h"
#include "trainer/growth/initial_model.h"
#include "trainer/growth/predicted_growth.h"
#include "trainer/options/schedule.h"
#include "trainer/options/strategy.h"
#include "trainer/run/progress.h"
#include "trainer/step/memory_plan.h"
#include "trainer/step/photos.h"
#include "trainer/step/trainer.h"

namespace darb {

namespace {

// The stand-in for a trained scene: most trained splats are more opaque than those at the start.
constexpr float kTrainedLogit = 0;  // an opacity of a half

// The measurement: enough to average over, no more than a moment.
constexpr int kViews = 4, kIterations = 10;
constexpr double kSeconds = 1.0;  // at most, for warming up and for measuring each
// More splats cost more to make than they tell; times beyond are extrapolated.
constexpr std::uint32_t kMostMeasuredCpu = 100'000, kMostMeasuredGpu = 1'000'000;

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

struct Measurement {
    double ms = 0;                    // an iteration
    std::uint64_t intersections = 0;  // the most of any frame
};

// The first round of density control, in which random splats go that no photo holds up.
int first_round(const Schedule& schedule) {
    return schedule.rounds.begin + schedule.rounds.interval;
}

// A few training views, evenly picked.
Dataset some_views(const Dataset& dataset) {
    Dataset few;
    few.root = dataset.root;
    std::vector<const View*> views;
    for (const View& view : dataset.views)
        if (!view.is_test) views.push_back(&view);
    const size_t count = std::min<size_t>(kViews, views.size());
    for (size_t i = 0; i < count; ++i) few.views.push_back(*views[i * views.size() / count]);
    return few;
}

std::vector<ImageU8> grey_photos(const std::vector<View>& views) {
    std::vector<ImageU8> photos;
    for (const View& view : views) {
        photos.emplace_back(view.camera.width, view.camera.height, 4);
        std::fill(photos.back().data.begin(), photos.back().data.end(), std::uint8_t{128});
    }
    return photos;
}

// Iterations until there were `most` or the time is over, at least a step's. Returns ms of one.
double timed_steps(Trainer& trainer, int most) {
    trainer.drain();
    const Clock::time_point start = Clock::now();
    const int begin = trainer.iteration();
    const auto done = [&] { return trainer.iteration() - begin; };
    while (done() == 0 || (done() < most && seconds_since(start) < kSeconds)) trainer.step();
    trainer.drain();
    return seconds_since(start) * 1e3 / done();
}

// With all bands of colour and no density control, from the first iteration on.
Measurement measure_training(Device& device, const Dataset& few, const SplatModel& model,
                             TrainOptions options) {
    options.densify_until = 0;
    options.probe_sh = false;
    options.sh_degree = model.sh_degree;
    options.resolution_ramp = false;
    SplatModel placeholder;  // restore() brings the model; two at once would double the memory
    placeholder.sh_degree = model.sh_degree;
    placeholder.kernel = model.kernel;
    placeholder.footprint = model.footprint;
    placeholder.origin = model.origin;
    Trainer trainer(device, few, grey_photos(few.views), placeholder, options);
    Trainer::State state;
    const Schedule& schedule = trainer.schedule();
    state.iteration = options.sh_degree * schedule.degree_interval;
    if (const int every = schedule.rest_every; every > 1)  // both ways of a step run at first
        state.iteration += every - 1 - state.iteration % every;
    state.model = model;
    state.moments.resize(kAttributeCount);
    trainer.restore(state);
    Measurement result;
    trainer.on_result = [&](const IterationResult& r) {
        result.intersections = std::max<std::uint64_t>(result.intersections, r.intersections);
    };
    // Compiles, and grows the buffers.
    timed_steps(trainer, std::max(2, static_cast<int>(few.views.size())));
    result.ms = timed_steps(trainer, kIterations);
    return result;
}

double intersections_per_splat(const Measurement& m, const SplatModel& model) {
    return static_cast<double>(m.intersections) / std::max(static_cast<double>(model.size()), 1.0);
}

// Splats and intersections at the end: of the splats that are wanted no more than a budget of
// memory leaves room for, where Trainer's growth stops.
void fit_size(const Device& device, const TrainOptions& options, std::uint32_t wanted,
              double intersections, Forecast& f) {
    const double room = intersection_room(intersections);
    const auto demand_for = [&](std::uint64_t splats) {
        f.demand.splats = splats;
        f.demand.intersections = static_cast<std::uint64_t>(room * static_cast<double>(splats));
    };
    f.splats = wanted;
    demand_for(wanted);
    if (!options.max_memory_bytes) return;
    MemoryDemand grown = f.demand;
    grown.intersections += grown.intersections / 2;
    const std::uint64_t within = std::max<std::uint64_t>(
        splats_within(device, grown, *options.max_memory_bytes), f.start_splats);
    f.splats = static_cast<std::uint32_t>(std::min<std::uint64_t>(wanted, within));
    demand_for(f.splats);
}

// The ramp's smaller photos, at the count at the start: the more it grows while they last, the more
// they save beyond that. Where most of the start goes they save the same share of what is left.
void measure_ramp(Device& device, const Dataset& few, const SplatModel& start,
                  const Schedule& schedule, Forecast& f) {
    int at_start = f.falls ? first_round(schedule) : schedule.options.iterations;
    for (const RampStep& step : schedule.ramp_steps(std::max(f.demand.width, f.demand.height))) {
        Dataset smaller = few;
        for (View& view : smaller.views) view.camera = divided(view.camera, step.divisor);
        const Measurement measured = measure_training(device, smaller, start, schedule.options);
        f.ramp_ms.push_back(measured.ms);
        if (at_start > 0) f.start_intersections = intersections_per_splat(measured, start);
        const int before = std::clamp(at_start, 0, step.iterations);
        at_start -= before;
        const double saved = 1 - f.ramp_ms.back() / f.start_ms;
        f.seconds -= saved * (before * f.start_ms + (step.iterations - before) * f.end_ms) / 1e3;
    }
}

// What stands for the scene that a run makes of random splats: fewer of them, which cover about one
// side of the region that they fill.
SplatModel surface_model(const Dataset& dataset, TrainOptions options, const SplatModel& start,
                         std::uint32_t count) {
    options.random_points = count;
    SplatModel model = initial_model(dataset, options);
    model.sh_degree = start.sh_degree;
    model.sh_rest.assign(model.size() * static_cast<size_t>(model.rest_count()), 0.0f);
    // Their distances are the cube root of the volume for each.
    const auto shrink = static_cast<float>(std::log(static_cast<double>(model.size())) / 6);
    for (float& scale : model.log_scale) scale -= shrink;
    std::fill(model.opacity_logit.begin(), model.opacity_logit.end(), kTrainedLogit);
    return model;
}

// How much of the run is as slow as its end, the rest as its start; in the mean.
double share_of_the_end(const Schedule& schedule, const Forecast& f) {
    if (f.falls) {
        const double before = first_round(schedule);
        return 1 - std::clamp(before / schedule.options.iterations, 0.0, 1.0);
    }
    if (f.splats == f.start_splats) return 0;
    return (mean_splats(f.start_splats, f.splats, schedule) - f.start_splats) /
           (double(f.splats) - f.start_splats);
}

// Times and intersections of the forecast, from the count at the start and one near that at the
// end.
void measure_both(Device& device, const Dataset& dataset, const SplatModel& start,
                  const Schedule& schedule, Forecast& f) {
    const TrainOptions& options = schedule.options;
    const Dataset few = some_views(dataset);
    const Measurement at_start = measure_training(device, few, start, options);
    f.start_ms = f.end_ms = at_start.ms;
    f.start_intersections = intersections_per_splat(at_start, start);
    const std::uint32_t wanted = f.splats;
    fit_size(device, options, wanted, f.start_intersections, f);
    const std::uint32_t most = device.info().type == "cpu" ? kMostMeasuredCpu : kMostMeasuredGpu;
    const std::uint32_t count = std::min(f.splats, most);
    const SplatModel later = f.falls ? surface_model(dataset, options, start, count)
                                     : split_model(start, count, options.seed);
    if (f.falls || later.size() != start.size()) {
        const Measurement at_end = measure_training(device, few, later, options);
        fit_size(device, options, wanted, intersections_per_splat(at_end, later), f);
        const auto measured = static_cast<double>(later.size());
        const double ms = f.falls ? at_end.ms : std::max(at_end.ms, at_start.ms);
        const double per_splat = f.falls ? ms / std::max(1.0, measured)
                                         : (ms - at_start.ms) / (measured - f.start_splats);
        f.end_ms = ms + per_splat * (f.splats - measured);
    }
    const double share = share_of_the_end(schedule, f);
    f.seconds = options.iterations * (f.start_ms + share * (f.end_ms - f.start_ms)) / 1e3;
    measure_ramp(device, few, start, schedule, f);
}

// The iterations with smaller photos.
int ramp_end(const Schedule& schedule, const Forecast& f) {
    int last = 0;
    for (const RampStep& step : schedule.ramp_steps(std::max(f.demand.width, f.demand.height)))
        last += step.iterations;
    return last;
}

// Splats in the last iteration with smaller photos, at most.
std::uint64_t splats_with_smaller_photos(const Schedule& schedule, const Forecast& f) {
    const double from = f.falls ? 0 : f.start_splats;
    const std::uint64_t grown =
        strategy_row(schedule.options.strategy)
            .forecast_until(schedule, ramp_end(schedule, f), from, f.splats);
    return std::max<std::uint64_t>(f.start_splats, grown);
}

// The peak is the most of three: what the end takes; what the last rounds of density control and
// drops of splats take, with the colour that there is by then; and what the first iterations take,
// with smaller photos or before most of a random start is gone. photos: as add_photos counts them,
// including the ramp's smaller ones.
void find_peak(const Device& device, const Schedule& schedule, const MemoryDemand& photos,
               Forecast& f) {
    const TrainOptions& options = schedule.options;
    f.peak = f.demand;
    f.peak.densifies = false;
    const auto take_larger = [&](const MemoryDemand& demand) {
        if (plan_memory(device, demand).total() > plan_memory(device, f.peak).total())
            f.peak = demand;
    };
    MemoryDemand rounds = f.demand;
    rounds.averages = false;
    rounds.sh_degree = predict_degree(schedule, schedule.last_change());
    if (rounds.densifies) take_larger(rounds);
    if (photos.small_cameras == 0 && !f.falls) return;
    MemoryDemand early = rounds;
    early.small_pixels = photos.small_pixels;
    early.small_cameras = photos.small_cameras;
    early.sh_degree =
        predict_degree(schedule, f.falls ? first_round(schedule) + 1 : ramp_end(schedule, f));
    early.splats = splats_with_smaller_photos(schedule, f);
    const double room =
        f.falls ? intersection_room(f.start_intersections)
                : double(f.demand.intersections) / std::max(1.0, double(f.demand.splats));
    early.intersections = static_cast<std::uint64_t>(room * double(early.splats));
    if (options.max_memory_bytes)  // growth stops before it
        early.splats =
            std::min(early.splats,
                     std::max<std::uint64_t>(
                         splats_within(device, early, *options.max_memory_bytes), f.start_splats));
    take_larger(early);
}

}  // namespace

SplatModel split_model(const SplatModel& start, std::uint32_t count, std::uint64_t seed) {
    const size_t n = start.size(), pieces = n == 0 ? 1 : std::max<size_t>(count / n, 1);
    if (pieces == 1) return start;
    // Splats lie on surfaces: k pieces cover one where each has a k-th of its area.
    const auto shrink = static_cast<float>(0.5 * std::log(double(pieces)));
    SplatModel model = start;
    model.resize(n * pieces);
    Pcg32 random(seed, 2);
    const size_t rest = static_cast<size_t>(start.rest_count());
    for (size_t i = 0; i < n * pieces; ++i) {
        const size_t from = i % n;
        for (size_t a = 0; a < 3; ++a) {
            const float scale = start.log_scale[3 * from + a];
            model.position[3 * i + a] =
                start.position[3 * from + a] +
                static_cast<float>(random.normal() * std::exp(double{scale}));
            model.log_scale[3 * i + a] = scale - shrink;
            model.sh_dc[3 * i + a] = start.sh_dc[3 * from + a];
        }
        for (size_t a = 0; a < 4; ++a) model.rotation[4 * i + a] = start.rotation[4 * from + a];
        for (size_t a = 0; a < rest; ++a)
            model.sh_rest[rest * i + a] = start.sh_rest[rest * from + a];
        model.opacity_logit[i] = kTrainedLogit;
        if (!start.shape.empty()) model.shape[i] = start.shape[from];
    }
    return model;
}

Forecast forecast_training(Device& scratch, const Dataset& dataset, const Schedule& schedule,
                           bool measure) {
    const TrainOptions& options = schedule.options;
    SplatModel start = initial_model(dataset, schedule);
    Forecast f;
    add_photos(dataset.views, schedule, f.demand);
    const MemoryDemand photos = f.demand;
    f.demand.small_pixels = f.demand.small_cameras = 0;  // none at the end
    f.demand.sh_degree = predict_degree(schedule, options.iterations);
    start.sh_degree = f.demand.sh_degree;  // the degree for the times
    if (options.probe_sh)
        start.sh_degree =
            std::min(start.sh_degree, options.iterations / 2 / schedule.degree_interval);
    start.sh_rest.assign(start.size() * static_cast<size_t>(start.rest_count()), 0.0f);
    f.start_splats = static_cast<std::uint32_t>(start.size());
    f.demand.streams = photos_stream(scratch, dataset, schedule, photos, f.start_splats);
    f.splats = wanted_splats(scratch, dataset, schedule, photos.photo_pixels, f.start_splats);
    f.demand.densifies = has_rounds(schedule);
    f.falls = starts_random(dataset, options) && has_rounds(schedule) &&
              strategy_row(options.strategy).prunes_random_start;
    f.demand.averages = schedule.averages();
    fit_size(scratch, options, f.splats, 0, f);
    if (measure && f.demand.photo_pixels > 0) try {
            Tuning as_run = scratch.tuning();
            const ScopeGuard restore([&, before = as_run] { scratch.set_tuning(before); });
            if (f.demand.streams) as_run.photos = PhotoPlace::streamed;  // as those of the run
            scratch.set_tuning(as_run);
            measure_both(scratch, dataset, start, schedule, f);
        } catch (const NoRoom&) {  // the run will say so itself, if it has none
        }
    find_peak(scratch, schedule, photos, f);
    return f;
}

namespace {

// Bytes per point: position and colour, added one by one, so that their room may be twice as large.
constexpr std::uint64_t kPointBytes = 3 * (8 + 1);
// Bytes per splat on the host while the model is made: its floats without the bands of colour, its
// distance to its neighbours, and its part of the search tree.
constexpr std::uint64_t kSplatBytes = splat_floats(0) * sizeof(float) + 8 + 16;

MemoryDemand demand_at_start(const Device& device, const Dataset& dataset, const Schedule& schedule,
                             std::uint32_t splats) {
    MemoryDemand demand;
    add_photos(dataset.views, schedule, demand);
    demand.streams = photos_stream(device, dataset, schedule, demand, splats);
    demand.splats = splats;
    demand.intersections = splats;  // at least, where a photo sees them
    demand.densifies = false;
    if (schedule.options.probe_sh) demand.sh_degree = 0;
    return demand;
}

}  // namespace

std::uint64_t free_host_bytes() {
    return std::min(free_memory(), address_space_left());
}

void check_start_memory(const Device& device, const Dataset& dataset, const Schedule& schedule,
                        std::uint64_t host_bytes) {
    const TrainOptions& options = schedule.options;
    const bool random = starts_random(dataset, options);
    const std::uint64_t points = random ? start_points(dataset, options) : 0;  // others are there
    const std::uint32_t splats = initial_count(dataset, options);
    const MemoryDemand demand = demand_at_start(device, dataset, schedule, splats);
    const MemoryPlan plan = plan_memory(device, demand);
    const std::uint64_t device_bytes = plan.total();
    const bool shared = device.info().unified_memory;
    const std::uint64_t host = points * kPointBytes + splats * kSplatBytes;
    const std::uint64_t left = host_bytes - std::min(host_bytes, plan.waiting_photos);
    const std::uint64_t room = device.info().heap_bytes;
    const std::uint64_t most = GpuSplats::max_count(device, demand.sh_degree, true);
    std::uint64_t fit = std::min<std::uint64_t>(splats, most);
    if (device_bytes > room) fit = std::min(fit, splats_within(device, demand, room));
    const double needed = double(host) + (shared ? double(device_bytes) : 0);
    if (needed > double(left)) {
        const double each = needed / double(std::max<std::uint64_t>({points, splats, 1}));
        fit = std::min(fit, static_cast<std::uint64_t>(double(left) / each));
    }
    const bool too_many_points = needed > double(left) && points > splats;
    if (fit >= splats && !too_many_points) return;
    const std::string option = random ? "--random-points" : "--cap-max";
    throw NoRoom(
        random ? fmt::format("--random-points {}", points)
               : fmt::format("{}: {} points", dataset.root.string(), splats),
        fmt::format("the start alone takes {} of device memory and {} of host memory; the device "
                    "has {}, the host {} left",
                    format_bytes(double(device_bytes)),
                    format_bytes(double(host + plan.waiting_photos)), format_bytes(double(room)),
                    format_bytes(double(host_bytes))),
        fit > 0 ? fmt::format("{} {} fits.", option, fit)
                : "Smaller photos do: -r 2 takes a quarter of their memory.");
}

}  // namespace darb
