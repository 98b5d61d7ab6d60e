// SPDX-License-Identifier: MIT
#include "tools/bench/measure.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <thread>

#include "engine/core/system.h"
#include "tools/bench/bench_report.h"

namespace darb {

namespace {

double now_s() {
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    return std::chrono::duration<double>(now).count();
}

}  // namespace

double milliseconds(const std::function<void()>& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
        .count();
}

OtherLoad::OtherLoad() : wall_(now_s()), own_(processor_seconds()), all_(machine_busy_seconds()) {}

double OtherLoad::cores() const {
    const double wall = now_s() - wall_;
    const double others = machine_busy_seconds() - all_ - (processor_seconds() - own_);
    return wall > 0 ? std::max(0.0, others / wall) : 0;
}

void take_samples(const Sampling& sampling, int per_sample,
                  const std::function<std::vector<PassTime>()>& once, BenchResult& result,
                  const std::function<void()>& prepare) {
    for (int run = 0; run < sampling.warm_up; ++run) {
        prepare();
        once();
    }
    result.per_sample = per_sample;
    std::vector<double> cpu;
    std::vector<std::pair<std::string, std::vector<double>>> passes;
    const OtherLoad others;
    const double start = now_s();
    const auto more = [&] {
        const int taken = static_cast<int>(result.samples.size());
        return taken < sampling.least ||
               (taken < sampling.most && now_s() - start < sampling.seconds);
    };
    while (more()) {
        prepare();
        const double cpu_before = processor_seconds();
        const double before = now_s();
        const std::vector<PassTime> times = once();
        const double wall = now_s() - before;
        result.samples.push_back(1e3 * wall / per_sample);
        cpu.push_back(1e3 * (processor_seconds() - cpu_before) / per_sample);
        for (const PassTime& pass : times) {
            auto known = std::find_if(passes.begin(), passes.end(),
                                      [&](const auto& p) { return p.first == pass.name; });
            if (known == passes.end()) known = passes.insert(passes.end(), {pass.name, {}});
            known->second.push_back(pass.ms / per_sample);
        }
    }
    result.beside_cores = others.cores();
    result.ms = spread_of(result.samples);
    result.cpu_ms = spread_of(cpu).median;
    for (const auto& [name, values] : passes) result.passes.push_back({name, spread_of(values)});
}

void rate_passes(const DeviceRates& rates, BenchResult& result) {
    for (PassFigure& pass : result.passes)
        if (const auto work = pass_work(pass.name, result.counts)) {
            pass.work = *work;
            pass.share = roofline_share(*work, rates, pass.ms.median);
        }
}

PassWork total_work(const BenchResult& result) {
    PassWork sum;
    for (const PassFigure& pass : result.passes) {
        sum.bytes += pass.work.bytes;
        sum.fma += pass.work.fma;
    }
    return sum;
}

double roofline_share(const BenchResult& result, const DeviceRates& rates) {
    double needed = 0, taken = 0;
    for (const PassFigure& pass : result.passes) {
        needed += pass.share * pass.ms.median;
        taken += pass.ms.median;
    }
    return taken > 0 && rates.bytes_per_s > 0 ? needed / taken : 0;
}

nlohmann::json machine_json() {
    return {{"date", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)))},
            {"num_cpus", std::thread::hardware_concurrency()},
            {"processor", processor_name()},
            {"load_avg", load_averages()},
            {"processes", process_counts()},
            {"scheduling", scheduling()},
            {"version", DARB_VERSION},
            {"commit", std::string(build_commit())}};
}

}  // namespace darb
