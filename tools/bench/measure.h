// SPDX-License-Identifier: MIT
// How `darb bench` measures a time: after a warm-up, with many samples, by the wall clock and the
// passes' timestamps side by side, and noting what else the machine did meanwhile.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/plan/roofline.h"
#include "tools/cost/accuracy_cost.h"

namespace darb {

struct Sampling {
    double seconds = 2;  // to spend on a case, after the least number of samples
    int least = 10, most = 200;
    int warm_up = 2;  // runs before the first sample
};

struct PassFigure {
    std::string name;
    Spread ms;
    PassWork work{};   // 0 for passes that pass_work does not know
    double share = 0;  // share of the roofline
};

/// A native loop that does the same work as a pass of the device, measured in the same samples.
struct Yardstick {
    std::string name;  // name of the pass
    Spread device_ms, native_ms;
    std::string agreement_name;  // psnr_db of the pictures, or relative_error of the sums
    double agreement = 0;        // between the two results
};

struct BenchResult {
    std::string name;
    Spread ms;                    // wall clock of one frame, step, sort or start
    std::vector<double> samples;  // ms, in the order taken
    double cpu_ms = 0;            // median processor time, all threads and child processes
    std::vector<PassFigure> passes;
    FrameCounts counts;       // means; 0 where a case has none
    double contributing = 0;  // splat-pixels
    double per_sample = 1;    // frames or steps that are averaged in a sample
    std::vector<Yardstick> yardsticks;
    double beside_cores = 0;  // cores that other processes kept busy meanwhile
    std::string note;
};

/// Fills ms, samples, cpu_ms, per_sample, passes (without work) and beside_cores. once: takes a
/// sample and returns its passes. prepare: called before each sample, not timed.
void take_samples(
    const Sampling& sampling, int per_sample, const std::function<std::vector<PassTime>()>& once,
    BenchResult& result, const std::function<void()>& prepare = [] {});

/// Fills in work and share of the passes from result.counts.
void rate_passes(const DeviceRates& rates, BenchResult& result);
/// Ratio of the roofline's time to the measured time, over all passes; 0 where no pass has work.
double roofline_share(const BenchResult& result, const DeviceRates& rates);
PassWork total_work(const BenchResult& result);

/// Processor time of other processes since construction, in cores; 0 where the system does not
/// tell.
class OtherLoad {
  public:
    OtherLoad();
    double cores() const;

  private:
    double wall_ = 0, own_ = 0, all_ = 0;  // seconds
};

/// Date, processors, load, scheduling class and build: the circumstances that a result must state.
nlohmann::json machine_json();

/// Runs a Vulkan frame or a native loop and returns its milliseconds.
double milliseconds(const std::function<void()>& work);

}  // namespace darb
