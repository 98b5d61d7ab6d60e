// SPDX-License-Identifier: MIT
#include "tools/bench/measure.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <thread>

#include "tools/bench/bench_report.h"

namespace darb {

namespace {

double seconds_of(clockid_t clock) {
    timespec t{};
    clock_gettime(clock, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// Processor time of this process and the children that it has waited for, s.
double own_seconds() {
    rusage children{};
    getrusage(RUSAGE_CHILDREN, &children);
    const auto of = [](const timeval& t) {
        return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    return seconds_of(CLOCK_PROCESS_CPUTIME_ID) + of(children.ru_utime) + of(children.ru_stime);
}

// Busy time of all processors since the machine started: user, nice, system, irq, softirq, steal.
double busy_seconds() {
    std::ifstream stat("/proc/stat");
    std::string cpu;
    double v[8] = {};
    stat >> cpu;
    for (double& one : v) stat >> one;
    if (!stat) return 0;
    return (v[0] + v[1] + v[2] + v[5] + v[6] + v[7]) / static_cast<double>(sysconf(_SC_CLK_TCK));
}

std::string first_line(const char* path) {
    std::ifstream file(path);
    std::string line;
    std::getline(file, line);
    return line;
}

std::string scheduling() {
    const int policy = sched_getscheduler(0);
    sched_param param{};
    sched_getparam(0, &param);
    if (policy == SCHED_RR) return fmt::format("SCHED_RR {}", param.sched_priority);
    if (policy == SCHED_FIFO) return fmt::format("SCHED_FIFO {}", param.sched_priority);
    return policy == SCHED_OTHER ? "SCHED_OTHER" : fmt::format("policy {}", policy);
}

std::string processor() {
    std::ifstream info("/proc/cpuinfo");
    for (std::string line; std::getline(info, line);)
        if (line.rfind("model name", 0) == 0 && line.find(": ") != std::string::npos)
            return line.substr(line.find(": ") + 2);
    return "unknown";
}

}  // namespace

double milliseconds(const std::function<void()>& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
        .count();
}

OtherLoad::OtherLoad()
    : wall_(seconds_of(CLOCK_MONOTONIC)), own_(own_seconds()), all_(busy_seconds()) {}

double OtherLoad::cores() const {
    const double wall = seconds_of(CLOCK_MONOTONIC) - wall_;
    const double others = busy_seconds() - all_ - (own_seconds() - own_);
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
    const double start = seconds_of(CLOCK_MONOTONIC);
    const auto more = [&] {
        const int taken = static_cast<int>(result.samples.size());
        return taken < sampling.least ||
               (taken < sampling.most && seconds_of(CLOCK_MONOTONIC) - start < sampling.seconds);
    };
    while (more()) {
        prepare();
        const double cpu_before = own_seconds();
        const double before = seconds_of(CLOCK_MONOTONIC);
        const std::vector<PassTime> times = once();
        const double wall = seconds_of(CLOCK_MONOTONIC) - before;
        result.samples.push_back(1e3 * wall / per_sample);
        cpu.push_back(1e3 * (own_seconds() - cpu_before) / per_sample);
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
    nlohmann::json load = nlohmann::json::array();
    double average[3] = {};
    if (getloadavg(average, 3) == 3)
        for (const double one : average) load.push_back(one);
    return {{"date", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)))},
            {"num_cpus", std::thread::hardware_concurrency()},
            {"processor", processor()},
            {"load_avg", load},
            {"processes", first_line("/proc/loadavg")},
            {"scheduling", scheduling()},
            {"version", DARB_VERSION},
            {"commit", std::string(build_commit())}};
}

}  // namespace darb
