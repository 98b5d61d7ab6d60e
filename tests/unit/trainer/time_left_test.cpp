// What is left of a run, on runs whose pace was recorded (tools/record_pace.py).
#include "trainer/time_left.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "engine/core/files.h"
#include "trainer/strategy.h"

namespace darb {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kFrom = 0.05, kMostOff = 2;  // share of the run; times
constexpr double kAnyway = 1.5;               // s: below that nobody is misled

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

// Whether a run's estimates are right within two times from 5 % of it on. The iterations of a
// sample take what its passes do; what else it took, as a probe, comes with the first of them.
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
        EXPECT_TRUE(said < kMostOff * truth && truth < kMostOff * said)
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
