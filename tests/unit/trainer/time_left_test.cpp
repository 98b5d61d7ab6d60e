// SPDX-License-Identifier: MIT
// The time left of a run, estimated for runs whose pace was recorded (tools/lab/record_pace.py).
#include "trainer/run/progress.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "engine/core/files.h"
#include "engine/core/rng.h"
#include "trainer/options/schedule.h"
#include "trainer/options/strategy.h"

namespace darb {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kFrom = 0.05, kMostOff = 2, kMostOffLater = 1.6;  // share of the run; times
constexpr double kAnyway = 1.5;                                    // s: below that nobody is misled

struct Recorded {
    std::string name;
    TrainOptions options;
    PaceForecast pace;
    json samples;
    double end_s() const { return samples.back()[1].get<double>(); }
};

std::vector<Recorded> recorded_runs() {
    std::vector<Recorded> runs;
    for (const auto& entry :
         fs::directory_iterator(fs::path(DARB_SOURCE_DIR) / "tests/unit/trainer/pace")) {
        const json file = json::parse(read_text_file(entry.path()));
        Recorded run{
            entry.path().stem().string(), {}, pace_from_json(file["forecast"]), file["samples"]};
        run.options.iterations = file["iterations"].get<int>();
        run.options.strategy = strategy_from_name(file["strategy"].get<std::string>()).value();
        run.options.probe_sh = file["probe_sh"].get<bool>();
        if (!file["max_splats"].is_null())
            run.options.max_splats = file["max_splats"].get<std::uint32_t>();
        runs.push_back(std::move(run));
    }
    return runs;
}

// Whether a run's estimates are right within a factor of two from 5 % of it on, and within 1.6 from
// 24 % on. The iterations of a sample take the time of its passes; other work, such as a probe, is
// added to the first of them.
void check(const Recorded& run) {
    TimeLeft left(run.options, run.pace);
    left.add(0, 0, run.pace.start_splats);
    const double end = run.end_s();
    int before = 0;
    double time = 0;
    for (const json& sample : run.samples) {
        const int iteration = sample[0].get<int>(), count = iteration - before;
        const double took = sample[1].get<double>() - time;
        const double each = std::min(1e-3 * sample[3].get<double>(), took / count);
        for (int i = 1; i <= count; ++i)
            left.add(before + i, time + took - each * (count - i), sample[2].get<std::uint32_t>());
        before = iteration;
        time += took;
        const double truth = end - time, said = left.seconds();
        if (iteration < kFrom * run.options.iterations || truth < kAnyway) continue;
        const double most = iteration < 0.24 * run.options.iterations ? kMostOff : kMostOffLater;
        EXPECT_TRUE(said < most * truth && truth < most * said)
            << run.name << ", iteration " << iteration << ": " << said << " s said, " << truth
            << " s were left";
    }
}

TEST(TimeLeft, is_never_off_by_more_than_two_times_on_recorded_runs) {
    const std::vector<Recorded> runs = recorded_runs();
    ASSERT_GE(runs.size(), 5U);
    for (const Recorded& run : runs) check(run);
}

TEST(TimeLeft, follows_a_device_that_is_half_as_fast_as_forecast) {
    for (Recorded run : recorded_runs()) {
        run.pace.start_ms /= 2;
        run.pace.end_ms /= 2;
        for (double& ms : run.pace.ramp_ms) ms /= 2;
        check(run);
    }
}

// A run about which everything is known: how it grows, what photos with a half and a quarter of the
// sides take, and how much slower the machine is while other programs use it. Iterations vary by up
// to 30 %, and now and then one takes as long as twenty.
struct MadeUp {
    std::string name;
    PaceForecast pace;
    double end_splats = 0;              // that the run comes to
    double busy = 1;                    // times as slow as a free machine,
    double busy_from = 0, busy_to = 0;  // in this part of the run
    Strategy strategy = Strategy::adc;
    double half_sides = 0.6, quarter_sides = 0.4;
};

constexpr double kMadeUpStart = 10'000;

PaceForecast made_up_pace(std::uint32_t splats, double start_ms, double end_ms,
                          std::vector<double> ramp_ms) {
    return {std::uint32_t(kMadeUpStart), splats, false, start_ms, end_ms, std::move(ramp_ms), 800};
}

std::vector<MadeUp> made_up_runs() {
    // A free machine takes 10 ms at the start and 1 ms more for each 2,000 splats beyond.
    const PaceForecast to_40 = made_up_pace(40'000, 10, 25, {4, 6});
    const PaceForecast to_200 = made_up_pace(200'000, 10, 105, {4, 6});
    PaceForecast busy_40 = made_up_pace(40'000, 30, 75, {12, 18});
    std::vector<MadeUp> runs;
    for (const Strategy strategy : {Strategy::adc, Strategy::budget}) {
        runs.push_back({"growth that comes", to_40, 40'000, 1, 0, 0, strategy});
        runs.push_back({"growth that does not come", to_200, kMadeUpStart, 1, 0, 0, strategy});
        runs.push_back({"a quarter of the growth", to_200, 55'000, 1, 0, 0, strategy});
        runs.push_back({"busy at first", busy_40, 40'000, 3, 0, 0.2, strategy});
        runs.push_back({"busy at first, no growth", busy_40, kMadeUpStart, 3, 0, 0.2, strategy});
        runs.push_back({"busy later", to_40, 40'000, 3, 0.2, 1, strategy});
        runs.push_back({"busy later, no growth", to_200, kMadeUpStart, 3, 0.2, 1, strategy});
        runs.push_back({"only the end was measured on a busy machine",
                        made_up_pace(40'000, 10, 150, {4, 6}), 40'000, 1, 0, 0, strategy});
        runs.push_back({"only the end was, and no growth", made_up_pace(200'000, 10, 630, {4, 6}),
                        kMadeUpStart, 1, 0, 0, strategy});
        runs.push_back({"only the start was", made_up_pace(40'000, 60, 60, {4, 6}), 40'000, 1, 0, 0,
                        strategy});
        runs.push_back({"only the smaller photos were", made_up_pace(40'000, 10, 25, {24, 36}),
                        40'000, 1, 0, 0, strategy});
    }
    runs.push_back({"twice the growth", to_40, 70'000});
    return runs;
}

// The factor by which the estimate is off at 24, 50 and 75 % of the run, the larger of both ways.
std::vector<double> factors_of(const MadeUp& run, int iterations) {
    TrainOptions options;
    options.iterations = iterations;
    options.strategy = run.strategy;
    options.probe_sh = false;
    if (run.strategy == Strategy::budget) options.max_splats = run.pace.splats;
    const Schedule schedule(options);
    const std::vector<double> path =
        growth_path(options, std::uint32_t(kMadeUpStart), std::uint32_t(run.end_splats));
    Pcg32 random(7, 1);
    std::vector<double> seconds{0}, counts{kMadeUpStart};
    for (int i = 1; i <= iterations; ++i) {
        const int divisor = schedule.resolution_divisor(i, run.pace.longest_side);
        const double photos = divisor == 1 ? 1 : divisor == 2 ? run.half_sides : run.quarter_sides;
        const double at = double(i) / iterations;
        const double busy = at > run.busy_from && at <= run.busy_to ? run.busy : 1;
        const auto here = static_cast<std::size_t>(i);
        const double splats = schedule.refines_after(i - 1) ? path[here - 1] : counts.back();
        counts.push_back(splats);
        const double noise = (i % 500 == 0 ? 20 : 0.7) + 0.6 * random.uniform();
        seconds.push_back(seconds.back() +
                          1e-3 * noise * photos * busy * (10 + (splats - kMadeUpStart) / 2'000));
    }
    TimeLeft left(options, run.pace);
    left.add(0, 0, run.pace.start_splats);
    std::vector<double> factors;
    for (int i = 1; i <= iterations; ++i) {
        const auto at = static_cast<std::size_t>(i);
        left.add(i, seconds[at], static_cast<std::uint32_t>(counts[at]));
        if (i != iterations * 24 / 100 && i != iterations / 2 && i != iterations * 3 / 4) continue;
        const double truth = seconds.back() - seconds[at];
        factors.push_back(std::max(left.seconds() / truth, truth / left.seconds()));
    }
    return factors;
}

TEST(TimeLeft, follows_the_run_that_comes_rather_than_the_one_that_was_forecast) {
    for (const int iterations : {1'000, 7'000, 30'000})
        for (const MadeUp& run : made_up_runs()) {
            const std::vector<double> factors = factors_of(run, iterations);
            ASSERT_EQ(factors.size(), 3U);
            for (std::size_t k = 0; k < 3; ++k)
                EXPECT_LT(factors[k], 1.5)
                    << run.name << ", " << strategy_name(run.strategy) << ", " << iterations
                    << " iterations, at " << std::vector{24, 50, 75}[k] << " %";
        }
}

TEST(TimeLeft, knows_that_growth_is_ahead_where_the_pace_so_far_does_not) {
    TrainOptions options;
    options.iterations = 30'000;
    const PaceForecast pace{10'000, 500'000, false, 10, 500, {}, 50};
    TimeLeft left(options, pace);
    left.add(0, 0, 10'000);
    left.add(300, 3, 10'000);  // 10 ms each: by the pace alone 5 minutes would be left
    EXPECT_GT(left.seconds(), 2 * 3'600);
}

TEST(TimeLeft, without_a_forecast_goes_by_the_pace) {
    TrainOptions options;
    options.iterations = 1'000;
    options.resolution_ramp = false;
    TimeLeft left(options, {1'000, 1'000, false, 0, 0, {}, 200});
    EXPECT_EQ(left.seconds(), 0);
    left.add(1, 5, 1'000);
    left.add(101, 15, 1'000);  // the first five seconds were no iterations
    EXPECT_NEAR(left.seconds(), 89.9, 0.1);
}

TEST(TimeLeft, a_pace_is_read_as_it_was_written) {
    const PaceForecast pace{1, 2, true, 3, 4, {5, 6}, 7};
    const PaceForecast read = pace_from_json(pace_json(pace));
    EXPECT_EQ(pace_json(read), pace_json(pace));
    EXPECT_THROW(pace_from_json(json::object()), json::exception);
}

}  // namespace
}  // namespace darb
