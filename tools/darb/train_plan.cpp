// SPDX-License-Identifier: MIT
#include "tools/darb/train_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/core/count_text.h"
#include "engine/core/say.h"
#include "engine/data/run_colmap.h"
#include "engine/gpu/device.h"
#include "tools/darb/open_cameras.h"
#include "trainer/job/request_options.h"
#include "trainer/options/presets.h"
#include "trainer/options/schedule.h"
#include "trainer/run/forecast.h"
#include "trainer/run/progress.h"
#include "trainer/step/photos.h"

namespace darb {

namespace {

constexpr int kShortRun = 200;  // iterations: such a run is over sooner than the measurement
constexpr double kLongSeconds = 3'600;  // from here on a smaller -r is suggested
constexpr int kSmallSide = 400;         // px: smaller photos are not suggested

// The next -r, which halves the photos' sides, where that leaves enough of them.
std::optional<int> smaller_resolution(const std::vector<View>& views) {
    const View& view = views.front();
    if (std::max(view.camera.width, view.camera.height) < 2 * kSmallSide) return std::nullopt;
    const double divisor = double(view.lens.width) / view.camera.width;
    for (const int r : {2, 4, 8})
        if (r > 1.5 * divisor) return r;
    return view.camera.width / 2;
}

// Two digits, because more would promise what a rule of thumb cannot keep.
std::string about(std::uint32_t count) {
    std::uint32_t unit = 1;
    while (count / unit >= 100) unit *= 10;
    return "about " + count_text(std::uint64_t{(count + unit / 2) / unit} * unit);
}

std::string time_text(const Forecast& f, const TrainOptions& options) {
    const int iterations = options.iterations;
    const bool changes = f.splats != f.start_splats;
    const std::string end = changes ? about(f.splats) : count_text(f.splats);
    if (f.seconds <= 0)
        return fmt::format(
            "{} iterations{}, {} splats at the end", count_text(iterations),
            f.start_ms > 0 ? fmt::format(", {:.1f} ms each at first", f.start_ms) : "", end);
    std::string text = fmt::format("about {} for {} iterations, {:.1f} ms each at {} splats",
                                   format_duration(f.seconds), count_text(iterations), f.start_ms,
                                   count_text(f.start_splats));
    for (std::size_t step = 0; step < f.ramp_ms.size(); ++step)
        text += fmt::format("{}{:.1f}", step == 0 ? " (with smaller photos at first " : ", ",
                            f.ramp_ms[step]);
    if (!f.ramp_ms.empty()) text += ")";
    const std::string later = changes ? fmt::format(", {:.1f} ms at {}", f.end_ms, end) : "";
    return text + later;
}

// The memory is exact if the counts come true. They are a rule of thumb, so the text also says what
// one splat takes.
std::string memory_text(const Device& device, const Forecast& f) {
    const auto bytes = [&](const MemoryDemand& demand) {
        return static_cast<double>(plan_memory(device, demand).total());
    };
    MemoryDemand empty = f.peak;
    empty.splats = empty.intersections = 0;
    const double all = bytes(f.peak), fixed = bytes(empty);
    const MemoryPlan plan = plan_memory(device, f.peak);
    const std::string photos = format_bytes(static_cast<double>(plan.photos));
    const std::string where =
        f.peak.streams ? fmt::format("photos stream from {} of host memory through {}",
                                     format_bytes(static_cast<double>(plan.waiting_photos)), photos)
                       : fmt::format("photos are {} of it", photos);
    return fmt::format("{} of device memory ({} and {:.0f} bytes a splat); {}", format_bytes(all),
                       format_bytes(fixed), (all - fixed) / std::max(1.0, double(f.peak.splats)),
                       where);
}

// Quiet runs are warned, too.
void print_advice(const Device& device, const Dataset& dataset, const Forecast& f, bool quiet) {
    const std::uint64_t budget = usable_bytes(device.info());
    const bool too_large = plan_memory(device, f.peak).total() > budget;
    if (!too_large && f.seconds < kLongSeconds) return;
    std::string advice;
    if (const auto r = smaller_resolution(dataset.views))
        advice += fmt::format(" -r {} takes about a quarter.", *r);
    const std::uint64_t most =
        std::min(splats_within(device, f.demand, budget), splats_within(device, f.peak, budget));
    if (too_large && most > 0)
        advice += fmt::format(" --cap-max {} stays within the memory.", most);
    if (too_large)
        say("warning: more than the {} of this device allow.{}\n",
            format_bytes(static_cast<double>(device.info().heap_bytes)), advice);
    else if (!advice.empty() && !quiet)
        say("hint:{}\n", advice);
}

// for a longer run without options, a quicker one is suggested
constexpr double kSlowSeconds = 1'800;

// The data set with photos of at most that width.
Dataset at_width(Dataset dataset, int width) {
    for (View& view : dataset.views)
        if (view.camera.width > width)
            view.camera = divided(view.camera, double(view.camera.width) / width);
    return dataset;
}

std::string time_of(double seconds) {
    return seconds > 0 ? "about " + format_duration(seconds) : "not measured";
}

// Quotes a word that the shell would take apart.
std::string typed(const std::string& word) {
    const bool plain = word.find_first_of(" '\"\\$`&|;<>()*?[]#~!{}") == std::string::npos;
    return plain ? word : shell_quoted(word);
}

// Prints how long the run's preset and those below it take here, and for a slow run without options
// what to type instead; nothing where --iterations was given. chosen: the forecast of the run.
// Measures each preset for a few seconds.
void print_presets(Device& scratch, const TrainJob& job, const Forecast& chosen) {
    const TrainRequest& request = job.request;
    if (was_given(request, "--iterations") || chosen.seconds <= 0) return;
    const bool width_given = was_given(request, "--resolution");
    const std::string_view own = request.preset.empty() ? kRunPresets.back().name : request.preset;
    std::string line, instead;
    for (const RunPreset& preset : kRunPresets) {
        double seconds = chosen.seconds;
        if (preset.name != own) {
            TrainOptions options = job.options;
            options.iterations = preset.iterations;
            seconds = forecast_training(
                          scratch, width_given ? job.dataset : at_width(job.dataset, preset.width),
                          options)
                          .seconds;
        }
        line += fmt::format("{}{} ({}; {} iterations{}) {}", line.empty() ? "" : ", ", preset.name,
                            preset.summary, preset.iterations,
                            width_given ? "" : fmt::format(" at {} px", preset.width),
                            time_of(seconds));
        // the larger presets take longer still, and longer to measure
        if (preset.name == own) break;
        instead += fmt::format("\n  darb train {} -o {} --preset {}    {}", typed(request.dataset),
                               typed(request.output.string()), preset.name, time_of(seconds));
    }
    say("presets: {}\n", line);
    if (request.preset.empty() && chosen.seconds > kSlowSeconds && !instead.empty())
        say("This takes {} here. Quicker, after Ctrl-C:{}\n", time_of(chosen.seconds), instead);
}

void print_forecast(const Device& device, TrainJob& job, bool quiet) {
    const Dataset& dataset = job.dataset;
    DeviceOptions options = command_device(job.request.device);
    Device scratch(options);
    scratch.set_tuning(device.tuning());
    const Forecast f =
        forecast_training(scratch, dataset, job.options, job.options.iterations >= kShortRun);
    if (!quiet) say("forecast: {}; {}\n", time_text(f, job.options), memory_text(device, f));
    print_advice(device, dataset, f, quiet);
    if (!quiet) print_presets(scratch, job, f);
    job.pace = pace_of(f);
}

void print_growth(const Schedule& schedule) {
    for (int i = 1; i < schedule.options.iterations; ++i)
        if (schedule.refines_after(i)) return;
    if (schedule.rounds.end > 0)
        say("growth: none, because it would end after {} iterations and begin after {}; a longer "
            "run or --densify-from-iter changes that\n",
            schedule.rounds.end, schedule.rounds.begin);
}

void print_scene(const Device& device, const TrainJob& job, std::size_t held_out) {
    const Dataset& dataset = job.dataset;
    say("{}: {}, {} photos to train on, {} held out, {} points\n", dataset.root.string(),
        dataset.source, count_text(dataset.views.size() - held_out), count_text(held_out),
        count_text(dataset.points.size()));
    say_notes(dataset.notes);
    say("device: {}\n", device.description());
    say("effects: {}\n", plan_line(job.effects));
    for (const std::string& note :
         {job.cameras_note, job.start_note, job.strategy_note, job.region_note})
        if (!note.empty()) say("{}\n", note);
    print_growth(job.options);
}

}  // namespace

void say_stereo_begins() {
    say_note("start: stereo between the photos takes about a second of one core for each");
}

void print_plan(Device& device, TrainJob& job, bool quiet) {
    const Dataset& dataset = job.dataset;
    const auto held_out =
        static_cast<std::size_t>(std::ranges::count_if(dataset.views, &View::is_test));
    if (!quiet) print_scene(device, job, held_out);
    // A resumed run knows better, and its progress shows the time left.
    if (job.resume_from.empty() && held_out < dataset.views.size())
        print_forecast(device, job, quiet);
}

}  // namespace darb
