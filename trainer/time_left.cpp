#include "trainer/time_left.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "trainer/probe.h"
#include "trainer/schedule.h"
#include "trainer/strategy.h"

namespace darb {

namespace {

// What was measured counts half after so much of the run, and so many iterations.
constexpr double kHalfLifeShare = 0.05, kHalfLifeIterations = 20;
// The forecast itself counts as so many measured iterations.
constexpr double kForecastIterations = 10;
// A step that takes more times as long as the others is no pace: a probe of the colour's degree, an
// evaluation, a scene that is saved. Where a device slows down for good, the steps follow.
constexpr double kOutlier = 2;
// Where no forecast was measured: of an iteration's time so much goes with the splats, and photos
// of a half and of a quarter of the sides take such shares.
constexpr double kSplatShare = 0.5, kHalfSides = 0.5, kQuarterSides = 0.35;
// Runs of adc end with more splats than the rule of thumb says: 1.3 to 4.7 times on photos of 50 to
// 200 px.
constexpr double kBeyondForecast = 2.5;
// How much faster or slower than forecast the splats may go on to grow.
constexpr double kLeastGrowth = 0.3, kMostGrowth = 3;

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

TimeLeft::TimeLeft(const TrainOptions& options, const PaceForecast& pace)
    : iterations_(options.iterations), pace_(pace) {
    const Schedule schedule(options);
    has_target_ = strategy_row(options.strategy).grows_to_limit;
    if (options.probe_sh && schedule.degree_interval < iterations_) {
        probe_at_ = schedule.degree_interval;
        probe_iterations_ = probe_iterations(schedule);
    }
    if (pace_.start_ms > 0) {
        measured_ms_ = modelled_ms_ = kForecastIterations * pace_.start_ms;
    } else {
        pace_.start_ms = 1;
        const double growth = double(pace_.splats) / std::max(1.0, double(pace_.start_splats));
        pace_.end_ms = 1 + kSplatShare * (growth - 1);
        pace_.ramp_ms.clear();
    }
    const std::uint32_t limit = options.max_splats.value_or(kAnyNumberOfSplats);
    std::uint32_t end = pace_.splats;
    if (!has_target_ && !pace_.falls && end > pace_.start_splats)
        end = static_cast<std::uint32_t>(std::min(kBeyondForecast * end, double(limit)));
    counts_ = growth_path(options, pace_.start_splats, end);
    if (pace_.falls)
        for (int i = 0; i <= iterations_; ++i)
            counts_[static_cast<std::size_t>(i)] =
                i < schedule.rounds.begin + schedule.rounds.interval ? pace_.start_splats
                                                                     : pace_.splats;
    ramp_.assign(static_cast<std::size_t>(iterations_) + 1, 1.0);
    std::size_t at = 0, step = 0;
    for (const RampStep& photos : schedule.ramp_steps(pace_.longest_side)) {
        const double share = step < pace_.ramp_ms.size() ? pace_.ramp_ms[step] / pace_.start_ms
                             : photos.divisor > 2        ? kQuarterSides
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

void TimeLeft::add(int iteration, double seconds, std::uint32_t splats) {
    iteration = std::min(iteration, iterations_);
    if (any_ && iteration > iteration_) {
        const double half_life =
            std::max(kHalfLifeIterations, kHalfLifeShare * static_cast<double>(iterations_));
        const double kept = std::exp2(-(iteration - iteration_) / half_life);
        double modelled = 0;
        for (int i = iteration_ + 1; i <= iteration; ++i) modelled += model_ms(i, splats);
        double measured = 1e3 * (seconds - last_s_);
        if (modelled_ms_ > 0)
            measured = std::min(measured, kOutlier * modelled * measured_ms_ / modelled_ms_);
        measured_ms_ = kept * measured_ms_ + measured;
        modelled_ms_ = kept * modelled_ms_ + modelled;
    }
    any_ = true;
    iteration_ = iteration;
    last_s_ = seconds;
    splats_ = splats;
}

// What the run has now, and what is forecast to come: up to the strategy's target, or as much
// faster or slower than forecast as it has grown so far.
double TimeLeft::later_splats(int iteration) const {
    const double now = counts_[static_cast<std::size_t>(iteration_)];
    const double later = counts_[static_cast<std::size_t>(iteration)] - now;
    const double to_come = counts_.back() - now;
    if (has_target_)
        return to_come == 0 ? splats_ : splats_ + (counts_.back() - splats_) * later / to_come;
    const double start = pace_.start_splats;
    double growth = 1;
    if (std::abs(now - start) > 0.1 * std::abs(counts_.back() - start))
        growth = std::clamp((splats_ - start) / (now - start), kLeastGrowth, kMostGrowth);
    return std::max(1.0, splats_ + growth * later);
}

double TimeLeft::seconds() const {
    if (modelled_ms_ <= 0) return 0;
    double ms = 0;
    for (int i = iteration_ + 1; i <= iterations_; ++i) {
        const double one = model_ms(i, later_splats(i));
        ms += i == probe_at_ ? (1 + probe_iterations_) * one : one;
    }
    return 1e-3 * ms * measured_ms_ / modelled_ms_;
}

}  // namespace darb
