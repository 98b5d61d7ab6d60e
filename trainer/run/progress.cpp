// SPDX-License-Identifier: MIT
#include "trainer/run/progress.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/core/count_text.h"
#include "engine/core/say.h"
#include "engine/core/system.h"
#include "trainer/options/schedule.h"
#include "trainer/options/strategy.h"
#include "trainer/step/held_out_gain.h"

namespace darb {

namespace {

// What was measured counts half after so much of the run, and so many iterations. Where the quick
// mean is so many times another than the steady one the machine has become busy or free since.
constexpr double kSteadyShare = 0.05, kSteadyIterations = 20;
constexpr double kQuickShare = 0.01, kQuickIterations = 8;
constexpr double kChanged = 1.25;
// The forecast itself counts as so many measured iterations.
constexpr double kForecastIterations = 10;
// A step that takes more times as long as the others is no pace: a probe of the colour's degree, an
// evaluation, a scene that is saved. Where a device slows down for good, the steps follow.
constexpr double kOutlier = 2;
// Used where no forecast was measured: how much of an iteration's time grows with the splats, and
// what share of it photos with a half and a quarter of the sides take.
constexpr double kSplatShare = 0.5, kHalfSides = 0.5, kQuarterSides = 0.35;
// A forecast is measured in a moment in which the machine may be busy, and then it says what cannot
// be: so much of the time of whole photos is the least for a half and for a quarter of the sides,
// and the time grows with at least such a power of the splats, and with the splats at most.
constexpr double kLeastHalf = 0.3, kLeastQuarter = 0.15, kLeastPower = 0.1;
// Runs of adc end with more splats than the rule of thumb says: 1.3 to 4.7 times on photos of 50 to
// 200 px.
constexpr double kBeyondForecast = 2.5;
// Growth that is late at first may come: the forecast counts as so much of the whole growth, until
// it fades. How much faster than forecast the splats may go on to grow; and the least share of the
// growth with which a strategy is on its way to its target.
constexpr double kForecastGrowth = 0.04;
constexpr double kMostGrowth = 3, kOnItsWay = 0.7;

// Half-way to what is usual, as a measurement of a few iterations may be that far off.
double photo_share(double measured, int divisor) {
    const double usual = divisor > 2 ? kQuarterSides : kHalfSides;
    const double least = divisor > 2 ? kLeastQuarter : kLeastHalf;
    return std::sqrt(std::clamp(measured, least, 1.0) * usual);
}

// The forecast's time at the end, where it can be.
double possible_end_ms(const PaceForecast& pace) {
    if (pace.falls || pace.splats <= pace.start_splats) return pace.end_ms;
    const double growth = double(pace.splats) / std::max(1.0, double(pace.start_splats));
    return pace.start_ms *
           std::clamp(pace.end_ms / pace.start_ms, std::pow(growth, kLeastPower), growth);
}

// Splats change in rounds, and the iteration after one is the first that has what it made.
std::vector<double> held_between_rounds(const Schedule& schedule, const std::vector<double>& path) {
    std::vector<double> counts{path.front()};
    for (std::size_t i = 1; i < path.size(); ++i)
        counts.push_back(schedule.refines_after(static_cast<int>(i) - 1) ? path[i - 1]
                                                                         : counts.back());
    return counts;
}

}  // namespace

PaceForecast pace_of(const Forecast& f) {
    return {f.start_splats,
            f.splats,
            f.falls,
            f.start_ms,
            f.end_ms,
            f.ramp_ms,
            static_cast<int>(std::max(f.demand.width, f.demand.height))};
}

nlohmann::json pace_json(const PaceForecast& pace) {
    return {{"start_splats", pace.start_splats}, {"splats", pace.splats}, {"falls", pace.falls},
            {"start_ms", pace.start_ms},         {"end_ms", pace.end_ms}, {"ramp_ms", pace.ramp_ms},
            {"longest_side", pace.longest_side}};
}

PaceForecast pace_from_json(const nlohmann::json& json) {
    return {json.at("start_splats").get<std::uint32_t>(),
            json.at("splats").get<std::uint32_t>(),
            json.at("falls").get<bool>(),
            json.at("start_ms").get<double>(),
            json.at("end_ms").get<double>(),
            json.at("ramp_ms").get<std::vector<double>>(),
            json.at("longest_side").get<int>()};
}

TimeLeft::TimeLeft(const Schedule& schedule, const PaceForecast& pace)
    : iterations_(schedule.options.iterations), pace_(pace) {
    const TrainOptions& options = schedule.options;
    has_target_ = strategy_row(options.strategy).grows_to_limit;
    if (options.probe_sh && schedule.degree_interval < iterations_)
        probes_[schedule.degree_interval] += DegreeProbe::iterations(schedule);
    if (const int at = ShutterProbe::at(schedule); at > 0 && at < iterations_)
        probes_[at] += ShutterProbe::iterations(schedule);
    const double all = iterations_;
    steady_.half_life = std::max(kSteadyIterations, kSteadyShare * all);
    quick_.half_life = std::max(kQuickIterations, kQuickShare * all);
    grown_.half_life = steady_.half_life;
    if (pace_.start_ms > 0) {
        pace_.end_ms = possible_end_ms(pace_);
        const double known = kForecastIterations * pace_.start_ms;
        steady_.measured = steady_.modelled = quick_.measured = quick_.modelled = known;
    } else {
        pace_.start_ms = 1;
        const double growth = double(pace_.splats) / std::max(1.0, double(pace_.start_splats));
        pace_.end_ms = 1 + kSplatShare * (growth - 1);
        pace_.ramp_ms.clear();
    }
    limit_ = options.max_splats.value_or(kAnyNumberOfSplats);
    std::uint32_t end = pace_.splats;
    if (!has_target_ && !pace_.falls && end > pace_.start_splats)
        end = static_cast<std::uint32_t>(std::min(kBeyondForecast * end, limit_));
    counts_ = held_between_rounds(schedule, growth_path(schedule, pace_.start_splats, end));
    if (pace_.falls)
        for (int i = 0; i <= iterations_; ++i)
            counts_[static_cast<std::size_t>(i)] =
                i < schedule.rounds.begin + schedule.rounds.interval ? pace_.start_splats
                                                                     : pace_.splats;
    grown_.measured = grown_.modelled = kForecastGrowth * (counts_.back() - counts_.front());
    ramp_.assign(static_cast<std::size_t>(iterations_) + 1, 1.0);
    std::size_t at = 0, step = 0;
    for (const RampStep& photos : schedule.ramp_steps(pace_.longest_side)) {
        const double share = step < pace_.ramp_ms.size()
                                 ? photo_share(pace_.ramp_ms[step] / pace_.start_ms, photos.divisor)
                             : photos.divisor > 2 ? kQuarterSides
                                                  : kHalfSides;
        for (int i = 0; i < photos.iterations && at + 1 < ramp_.size(); ++i) ramp_[++at] = share;
        ++step;
    }
}

double TimeLeft::model_ms(int iteration, double splats) const {
    const double grown = double(pace_.splats) - pace_.start_splats;
    const double share = grown == 0 ? 0 : (splats - pace_.start_splats) / grown;
    const double ms = pace_.start_ms + share * (pace_.end_ms - pace_.start_ms);
    const double least = 0.2 * std::min(pace_.start_ms, pace_.end_ms);
    return std::max(ms, least) * ramp_[static_cast<std::size_t>(iteration)];
}

void TimeLeft::Faded::add(double new_measured, double new_modelled, int iterations) {
    const double kept = std::exp2(-iterations / half_life);
    measured = kept * measured + new_measured;
    modelled = kept * modelled + new_modelled;
}

// Measured over modelled time.
double TimeLeft::pace() const {
    const double quick = quick_.ratio(), steady = steady_.ratio();
    return quick > kChanged * steady || steady > kChanged * quick ? quick : steady;
}

void TimeLeft::add(int iteration, double seconds, std::uint32_t splats) {
    iteration = std::min(iteration, iterations_);
    if (any_ && iteration > iteration_) {
        const int count = iteration - iteration_;
        double modelled = 0;
        for (int i = iteration_ + 1; i <= iteration; ++i) modelled += model_ms(i, splats);
        double measured = 1e3 * (seconds - last_s_);
        if (quick_.modelled > 0)
            measured = std::min(measured, kOutlier * modelled * quick_.ratio());
        steady_.add(measured, modelled, count);
        quick_.add(measured, modelled, count);
        grown_.add(splats - splats_,
                   counts_[static_cast<std::size_t>(iteration)] -
                       counts_[static_cast<std::size_t>(iteration_)],
                   count);
    }
    any_ = true;
    iteration_ = iteration;
    last_s_ = seconds;
    splats_ = splats;
}

// The share of the forecast growth that has come lately.
double TimeLeft::growth() const {
    if (grown_.modelled == 0) return 1;
    const double share = std::clamp(grown_.ratio(), 0.0, kMostGrowth);
    return has_target_ && share > kOnItsWay ? 1 : share;
}

// What the run has now, and as much of the growth that is forecast as has come lately; of a
// strategy with a target as much of what is left until there.
double TimeLeft::later_splats(int iteration) const {
    const double now = counts_[static_cast<std::size_t>(iteration_)];
    const double later = counts_[static_cast<std::size_t>(iteration)] - now;
    const double to_come = counts_.back() - now;
    if (has_target_) {
        const double left = to_come == 0 ? 0 : (counts_.back() - splats_) * later / to_come;
        return splats_ + growth() * left;
    }
    return std::clamp(splats_ + growth() * later, 1.0, std::max(limit_, splats_));
}

double TimeLeft::seconds() const {
    if (steady_.modelled <= 0) return 0;
    double ms = 0;
    for (int i = iteration_ + 1; i <= iterations_; ++i) {
        const double one = model_ms(i, later_splats(i));
        const auto probe = probes_.find(i);
        ms += probe == probes_.end() ? one : (1 + probe->second) * one;
    }
    return 1e-3 * ms * pace();
}

namespace {
constexpr double kSmoothing = 0.05;
constexpr double kTerminalSeconds = 0.2, kPlainSeconds = 10.0;
}  // namespace

std::string format_duration(double seconds) {
    const auto whole = static_cast<long>(seconds + 0.5);
    if (whole < 60) return fmt::format("{} s", whole);
    if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
    return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

std::string format_bytes(double bytes) {
    if (bytes < 1024.0 * 1024.0) return fmt::format("{:.0f} KiB", bytes / 1024.0);
    if (bytes < 1024.0 * 1024.0 * 1024.0) return fmt::format("{:.0f} MiB", bytes / 1024.0 / 1024.0);
    return fmt::format("{:.1f} GiB", bytes / 1024.0 / 1024.0 / 1024.0);
}

Progress::Progress(int first_iteration, int last_iteration, bool quiet)
    : first_(first_iteration),
      last_(last_iteration),
      quiet_(quiet),
      terminal_(is_terminal(stderr)),
      start_(Clock::now()),
      last_print_(start_),
      begin_(start_) {}

void Progress::expect(const Schedule& schedule, const PaceForecast& pace) {
    left_.emplace(schedule, pace);
}

void Progress::update(const IterationResult& r, const Device& device) {
    loss_ = any_ ? loss_ + kSmoothing * (r.loss - loss_) : r.loss;
    psnr_db_ = any_ ? psnr_db_ + kSmoothing * (r.psnr_db - psnr_db_) : r.psnr_db;
    any_ = true;
    const auto now = Clock::now();
    if (left_)
        left_->add(r.iteration, std::chrono::duration<double>(now - begin_).count(), r.splats);
    if (quiet_) return;
    const double since = std::chrono::duration<double>(now - last_print_).count();
    if (since < (terminal_ ? kTerminalSeconds : kPlainSeconds) && r.iteration < last_) return;
    last_print_ = now;
    say_text(fmt::format(fmt::runtime(terminal_ ? "\r{}\033[K" : "{}\n"), text(r, device)));
}

double Progress::seconds_left(int iteration) const {
    const double seconds = std::chrono::duration<double>(Clock::now() - start_).count();
    const double rate = (iteration - first_ + 1) / std::max(seconds, 1e-6);
    const double left = left_ ? left_->seconds() : 0;
    return left > 0 ? left : std::max(0.0, (last_ - iteration) / std::max(rate, 1e-9));
}

std::string Progress::text(const IterationResult& r, const Device& device) const {
    const double seconds = std::chrono::duration<double>(Clock::now() - start_).count();
    const double done = r.iteration - first_ + 1;
    const double rate = done / std::max(seconds, 1e-6);
    const double left = seconds_left(r.iteration);
    std::string bar;
    if (terminal_) {
        const int filled = static_cast<int>(20.0 * r.iteration / std::max(last_, 1));
        bar = "[" + std::string(filled, '#') + std::string(20 - filled, '.') + "] ";
    }
    return fmt::format(
        "{}{}/{}  {:.1f} it/s  {:.1f} ms  loss {:.4f}  PSNR {:.2f} dB  {} splats  {}  {} left", bar,
        r.iteration, last_, rate, 1000.0 / rate, loss_, psnr_db_, count_text(r.splats),
        format_bytes(static_cast<double>(device.allocated_bytes())), format_duration(left));
}

void Progress::note(const std::string& line) {
    if (!quiet_) line_of_its_own(line);
}

void Progress::warn(const std::string& line) {
    line_of_its_own("warning: " + line);
}

void Progress::line_of_its_own(const std::string& line) const {
    say_text(fmt::format(fmt::runtime(terminal_ ? "\r{}\033[K\n" : "{}\n"), printable(line)));
}

void Progress::restart_rate(int iteration) {
    first_ = iteration;
    start_ = Clock::now();
}

void Progress::leave_out(double seconds) {
    const auto left_out =
        std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
    start_ += left_out;
    begin_ += left_out;
}

void Progress::finish() {
    if (!quiet_ && terminal_ && any_) say_text("\n");
}

}  // namespace darb
