#include <fmt/format.h>

#include <algorithm>

#include "engine/core/rng.h"
#include "engine/primitives/radix_sort.h"
#include "engine/primitives/scan.h"
#include "tools/bench/cases.h"
#include "tools/bench/native_sort.h"

namespace darb {

namespace {

std::vector<std::uint32_t> random_words(std::uint32_t count, std::uint32_t bound) {
    Pcg32 random(3, 4);
    std::vector<std::uint32_t> words(count);
    for (std::uint32_t& word : words) word = bound == 0 ? random.next() : random.below(bound);
    return words;
}

// The samples of the native work, taken after the device's; same: whether the results are.
Yardstick yardstick(const std::string& pass, const BenchResult& result, const Sampling& sampling,
                    bool same, const std::function<double()>& native) {
    std::vector<double> ms;
    for (int i = 0; i < std::clamp(sampling.least, 1, 10); ++i) ms.push_back(native());
    return {pass, result.passes.empty() ? result.ms : result.passes[0].ms, spread_of(ms),
            "same_result", same ? 1.0 : 0.0};
}

BenchResult measure_sort(Device& device, std::uint32_t count, const DeviceRates& rates,
                         const Sampling& sampling) {
    const std::vector<std::uint32_t> keys = random_words(count, 0);
    const std::uint64_t bytes = std::uint64_t{count} * 4;
    Buffer unsorted(device, "unsorted", bytes), size(device, "count", 4);
    const Buffer key(device, "keys", bytes), value(device, "values", bytes);
    RadixSort sort(device, count);
    Commands commands(device);
    size.upload(std::vector<std::uint32_t>{count});
    unsorted.upload(keys);
    BenchResult result;
    take_samples(
        sampling, 1,
        [&] {
            commands.begin();
            commands.pass("depth sort");  // the name by which roofline.cpp knows 32-bit keys
            sort.record(commands, key, value, size, 0, 32, true);
            commands.submit_and_wait();
            return commands.pass_times();
        },
        result,
        [&] {  // the keys of the last sample are sorted now
            commands.begin();
            commands.copy(unsorted, key, bytes);
            commands.submit_and_wait();
        });
    result.counts.visible = count;
    rate_passes(rates, result);
    for (PassFigure& pass : result.passes) pass.name = "radix sort";
    NativeSort native;
    std::vector<std::uint32_t> k = keys, v(count);
    for (std::uint32_t i = 0; i < count; ++i) v[i] = i;
    native.sort(k, v);
    const bool same =
        k == key.download<std::uint32_t>(count) && v == value.download<std::uint32_t>(count);
    result.yardsticks.push_back(yardstick("radix sort", result, sampling, same, [&] {
        k = keys;
        return milliseconds([&] { native.sort(k, v); });
    }));
    return result;
}

BenchResult measure_scan(Device& device, std::uint32_t count, const DeviceRates& rates,
                         const Sampling& sampling) {
    const std::vector<std::uint32_t> counts = random_words(count, 100);
    const std::uint64_t bytes = std::uint64_t{count} * 4;
    Buffer from(device, "counts", bytes), size(device, "count", 4);
    const Buffer to(device, "offsets", bytes), total(device, "total", 4);
    from.upload(counts);
    size.upload(std::vector<std::uint32_t>{count});
    Scan scan(device, count);
    Commands commands(device);
    BenchResult result;
    take_samples(
        sampling, 1,
        [&] {
            commands.begin();
            commands.pass("scan");
            scan.record(commands, from, to, size, 0, total);
            commands.submit_and_wait();
            return commands.pass_times();
        },
        result);
    result.counts.splats = count;
    rate_passes(rates, result);
    std::vector<std::uint32_t> offsets;
    native_scan(counts, offsets);
    const bool same = offsets == to.download<std::uint32_t>(count);
    result.yardsticks.push_back(yardstick("scan", result, sampling, same, [&] {
        return milliseconds([&] { native_scan(counts, offsets); });
    }));
    return result;
}

}  // namespace

std::vector<BenchCase> sort_cases() {
    std::vector<BenchCase> cases;
    for (const std::uint32_t millions : {1u, 10u}) {
        const std::uint32_t count = millions * 1'000'000;
        cases.push_back({fmt::format("sort/{}M", millions), "",
                         [=](Device& device, const DeviceRates& rates, const BenchOptions& o) {
                             return measure_sort(device, count, rates, o.sampling);
                         }});
        cases.push_back({fmt::format("scan/{}M", millions), "",
                         [=](Device& device, const DeviceRates& rates, const BenchOptions& o) {
                             return measure_scan(device, count, rates, o.sampling);
                         }});
    }
    return cases;
}

}  // namespace darb
