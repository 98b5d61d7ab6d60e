// SPDX-License-Identifier: MIT
#include "tools/bench/bench_report.h"

#include <fmt/format.h>
#include <cmath>

#include "engine/plan/tuner.h"
#include "tools/bench/native_blend.h"

namespace darb {

namespace {

using Json = nlohmann::json;

constexpr int kNameWidth = 36;

Json spread_json(const Spread& s) {
    return {{"median", s.median}, {"quartile_low", s.low}, {"quartile_high", s.high}};
}

// 913k, 1.45M, 12.3G
std::string si(double v) {
    constexpr const char* units[] = {"", "k", "M", "G", "T"};
    int unit = 0;
    while (std::abs(v) >= 999.5 && unit < 4) {
        v /= 1000;
        ++unit;
    }
    const int decimals = unit == 0 || v >= 99.95 ? 0 : v >= 9.995 ? 1 : 2;
    return fmt::format("{:.{}f}{}", v, decimals, units[unit]);
}

long runs(const BenchResult& r) {
    return std::lround(static_cast<double>(r.samples.size()) * r.per_sample);
}

double spread_percent(const Spread& s) {
    return s.median > 0 ? 50 * (s.high - s.low) / s.median : 0;
}

std::string line(const std::string& name, const Spread& ms) {
    return fmt::format("{:<{}} {:>10.3f} ms {:>6.1f} %", name, kNameWidth, ms.median,
                       spread_percent(ms));
}

std::string counters(const BenchResult& r, const DeviceRates& rates) {
    std::string text;
    const auto add = [&](const char* name, double value) {
        if (value > 0) text += fmt::format(" {}={}", name, si(value));
    };
    add("splats", r.counts.splats);
    add("visible", r.counts.visible);
    add("pairs", r.counts.intersections);
    add("evaluated", r.counts.evaluated);
    add("contributing", r.contributing);
    const PassWork work = total_work(r);
    add("bytes", work.bytes);
    add("fma", work.fma);
    if (const double share = roofline_share(r, rates); share > 0)
        text += fmt::format(" roofline={:.0f}%", 100 * share);
    if (r.beside_cores >= 0.05) text += fmt::format(" beside={:.2f}", r.beside_cores);
    return text;
}

Json counts_json(const BenchResult& r) {
    return {{"splats", r.counts.splats},
            {"visible", r.counts.visible},
            {"pairs", r.counts.intersections},
            {"pixels", r.counts.pixels},
            {"evaluated_splat_pixels", r.counts.evaluated},
            {"contributing_splat_pixels", r.contributing}};
}

}  // namespace

Json context_json(const Device& device, const DeviceRates& rates, const std::string& note) {
    Json context = machine_json();
    context["executable"] = "darb bench";
    context["device"] = device.info().name;
    context["driver"] = device.info().driver;
    context["tuning"] = names_text(tuning_names(device.tuning()));
    context["copy_bytes_per_s"] = rates.bytes_per_s;
    context["fma_per_s"] = rates.fma_per_s;
    context["native_instructions"] = native_instructions();
    context["note"] = note;
    return context;
}

std::string context_text(const Json& c) {
    std::string load;
    for (const Json& one : c["load_avg"]) load += fmt::format(" {:.2f}", one.get<double>());
    return fmt::format(
        "{}\n{}, {}\n{} x {}; load average{}; {}; darb {} ({})\n"
        "copies {}B/s, {} multiply-adds/s; native loops: {}\npasses: {}\n{}\n{:<{}} {:>13} {:>8} "
        "{:>13} {:>6}\n"
        "{}\n",
        c["date"].get<std::string>(), c["device"].get<std::string>(),
        c["driver"].get<std::string>(), c["num_cpus"].get<unsigned>(),
        c["processor"].get<std::string>(), load, c["scheduling"].get<std::string>(),
        c["version"].get<std::string>(), c["commit"].get<std::string>(),
        si(c["copy_bytes_per_s"].get<double>()), si(c["fma_per_s"].get<double>()),
        c["native_instructions"].get<std::string>(), c["tuning"].get<std::string>(),
        std::string(100, '-'), "Benchmark", kNameWidth, "Median", "Spread", "CPU", "Runs",
        std::string(100, '-'));
}

std::string result_text(const BenchResult& r, const DeviceRates& rates, bool details) {
    std::string text = fmt::format(
        "{} {:>10.3f} ms {:>6}{}\n", line(r.name, r.ms), r.cpu_ms,
        static_cast<int>(static_cast<double>(r.samples.size()) * r.per_sample), counters(r, rates));
    if (!r.note.empty()) text += fmt::format("  {}\n", r.note);
    if (!details) return text;
    for (const PassFigure& pass : r.passes) {
        text += line("  " + pass.name, pass.ms);
        if (pass.share > 0)
            text += fmt::format("  {:.0f}% of the roofline, {}B, {} fma", 100 * pass.share,
                                si(pass.work.bytes), si(pass.work.fma));
        text += "\n";
    }
    for (const Yardstick& y : r.yardsticks)
        text += fmt::format("{}  {:.2f} times native; device {:.3f} ms; {} {:.4g}\n",
                            line("  native " + y.name, y.native_ms),
                            y.device_ms.median / y.native_ms.median, y.device_ms.median,
                            y.agreement_name, y.agreement);
    return text;
}

Json result_json(const BenchResult& r, const DeviceRates& rates) {
    Json passes = Json::object(), yardsticks = Json::object();
    for (const PassFigure& pass : r.passes) {
        passes[pass.name] = spread_json(pass.ms);
        if (pass.share > 0)
            passes[pass.name].update(
                Json{{"bytes", pass.work.bytes}, {"fma", pass.work.fma}, {"roofline", pass.share}});
    }
    for (const Yardstick& y : r.yardsticks)
        yardsticks[y.name] = {{"device_ms", spread_json(y.device_ms)},
                              {"native_ms", spread_json(y.native_ms)},
                              {"times_native", y.device_ms.median / y.native_ms.median},
                              {y.agreement_name, y.agreement}};
    const PassWork work = total_work(r);
    Json json{{"name", r.name},
              {"run_name", r.name},
              {"run_type", "iteration"},
              {"repetitions", 1},
              {"repetition_index", 0},
              {"threads", 1},
              {"iterations", runs(r)},
              {"real_time", r.ms.median},
              {"cpu_time", r.cpu_ms},
              {"time_unit", "ms"},
              {"quartile_low", r.ms.low},
              {"quartile_high", r.ms.high},
              {"samples", r.samples},
              {"bytes", work.bytes},
              {"fma", work.fma},
              {"roofline", roofline_share(r, rates)},
              {"beside_cores", r.beside_cores},
              {"passes", passes},
              {"yardsticks", yardsticks}};
    json.update(counts_json(r));
    if (!r.note.empty()) json["label"] = r.note;
    return json;
}

Report bench_report(const std::vector<BenchResult>& results, const DeviceRates& rates,
                    const Json& context) {
    Report report("Benchmarks", context["device"].get<std::string>() + ", " +
                                    context["driver"].get<std::string>());
    using Kind = TableColumn::Kind;
    Table table{"benchmarks", "Benchmarks", "Medians and quartiles of the wall clock.", {}, {}};
    Table passes{"passes", "Passes", "Medians and quartiles of the device's timestamps.", {}, {}};
    table.columns = {{"benchmark", "", Better::neither, 0, Kind::name},
                     {"time", "ms", Better::neither, 3},
                     {"splats", "", Better::neither, 0},
                     {"intersections", "", Better::neither, 0},
                     {"of the roofline", "%", Better::neither, 0},
                     {"runs", "", Better::neither, 0}};
    passes.columns = {{"benchmark", "", Better::neither, 0, Kind::name},
                      {"pass", "", Better::neither, 0, Kind::name},
                      {"time", "ms", Better::neither, 3},
                      {"of the roofline", "%", Better::neither, 0}};
    const auto timed = [](const Spread& ms) {
        TableCell cell(ms.median);
        cell.span = {ms.low, ms.high};
        return cell;
    };
    const auto above_zero = [](double v) { return v > 0 ? TableCell(v) : TableCell(); };
    for (const BenchResult& r : results) {
        table.rows.push_back(
            {{r.name, timed(r.ms), above_zero(r.counts.splats), above_zero(r.counts.intersections),
              above_zero(100 * roofline_share(r, rates)), double(runs(r))}});
        for (const PassFigure& pass : r.passes)
            passes.rows.push_back(
                {{r.name, pass.name, timed(pass.ms), above_zero(100 * pass.share)}});
    }
    report.table(std::move(table), 2);
    report.table(std::move(passes), 2);
    return report;
}

}  // namespace darb
