// SPDX-License-Identifier: MIT
// Scan against std::exclusive_scan: adversarial sizes and values, both team forms, guard words.
#include "engine/primitives/scan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "engine/core/error.h"
#include "engine/core/rng.h"
#include "tests/support/test_device_options.h"

namespace darb {
namespace {

using Words = std::vector<std::uint32_t>;

constexpr std::uint32_t kGuard = 0xdeadbeef;
constexpr std::size_t kGuardWords = 64;  // before the results that tests compare, and after them

Words make_values(const std::string& kind, std::size_t n) {
    Pcg32 rng(n + 1);
    Words values(n);
    for (std::size_t i = 0; i < n; ++i) {
        if (kind == "ones") values[i] = 1;
        if (kind == "small") values[i] = rng.below(100);
        if (kind == "wrapping") values[i] = rng.next();
        if (kind == "sparse") values[i] = rng.below(1000) == 0 ? 1'000'000 : 0;
    }
    return values;
}

struct Outcome {
    Words offsets;  // with the guard words behind them
    Words total;    // guard, total, guard
};

struct ScanRun {
    Device device{test::device_options()};
    Commands commands{device};
    Scan scan;
    Buffer counts, offsets, count, total;

    ScanRun(std::uint32_t capacity, const Scan::Strategy& strategy)
        : scan(device, capacity, strategy),
          counts(device, "counts", (capacity + kGuardWords) * 4),
          offsets(device, "offsets", (capacity + kGuardWords) * 4),
          count(device, "count", 64 * 4),
          total(device, "total", 3 * 4) {}

    Outcome run(const Words& values, std::uint32_t n, bool in_place) {
        counts.upload(values);
        Words count_words(64, kGuard);
        count_words[5] = n;
        count.upload(count_words);
        const Buffer& result = in_place ? counts : offsets;
        commands.begin();
        commands.pass("guards");
        commands.fill(offsets, kGuard);
        if (in_place) commands.fill(BufferRange(counts, values.size() * 4), kGuard);
        commands.fill(total, kGuard);
        commands.pass("scan");
        scan.record(commands, counts, result, count, 20, BufferRange(total, 4));
        commands.submit_and_wait();
        return {result.download<std::uint32_t>(values.size() + kGuardWords),
                total.download<std::uint32_t>(3)};
    }
};

void expect_scanned(const Words& values, std::size_t n, const Outcome& outcome, bool in_place) {
    Words expected(n);
    std::exclusive_scan(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(n),
                        expected.begin(), 0U);
    const std::uint32_t sum =
        std::accumulate(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(n), 0U);
    for (std::size_t i = 0; i < n; ++i)
        ASSERT_EQ(outcome.offsets[i], expected[i]) << "offset " << i << " of " << n;
    for (std::size_t i = n; i < outcome.offsets.size(); ++i) {
        const bool untouched_input = in_place && i < values.size();
        ASSERT_EQ(outcome.offsets[i], untouched_input ? values[i] : kGuard) << "word " << i;
    }
    EXPECT_EQ(outcome.total, (Words{kGuard, sum, kGuard})) << "n = " << n;
}

class ScanTeams : public ::testing::TestWithParam<bool> {
  protected:
    Scan::Strategy strategy(std::uint32_t subgroup_size = 0) const {
        return {GetParam(), subgroup_size};
    }
};

TEST_P(ScanTeams, sizes_around_every_boundary_match) {
    const std::vector<std::uint32_t> sizes = {
        0,    1,    2,    31,   32,    33,    255,   256,   257,   2047,  2048,
        2049, 8191, 8192, 8193, 32767, 32768, 32769, 65535, 65536, 65537, 100'000};
    ScanRun setup(100'000, strategy());
    for (const std::uint32_t n : sizes) {
        const Words values = make_values("small", 100'000);
        expect_scanned(values, n, setup.run(values, n, false), false);
    }
}

TEST_P(ScanTeams, exact_capacity_writes_nothing_behind) {
    for (const std::uint32_t n : {1U, 255U, 256U, 257U, 8193U}) {
        ScanRun setup(n, strategy());
        const Words values = make_values("wrapping", n);
        expect_scanned(values, n, setup.run(values, n, false), false);
    }
}

TEST_P(ScanTeams, a_million_elements_of_every_kind_match) {
    constexpr std::uint32_t kN = 1'000'003;
    ScanRun setup(kN, strategy());
    for (const std::string kind : {"ones", "small", "wrapping", "sparse"}) {
        const Words values = make_values(kind, kN);
        expect_scanned(values, kN, setup.run(values, kN, false), false);
    }
}

TEST_P(ScanTeams, in_place_gives_the_same) {
    ScanRun setup(70'000, strategy());
    const Words values = make_values("small", 70'000);
    for (const std::uint32_t n : {0U, 300U, 65'537U, 70'000U})
        expect_scanned(values, n, setup.run(values, n, true), true);
}

TEST_P(ScanTeams, count_above_the_capacity_is_cut) {
    ScanRun setup(1000, strategy());
    const Words values = make_values("small", 1000);
    for (const std::uint32_t n : {1001U, 0xffffffffU})
        expect_scanned(values, 1000, setup.run(values, n, false), false);
}

TEST_P(ScanTeams, every_subgroup_size_of_the_device_matches) {
    const DeviceInfo info = Device().info();
    for (std::uint32_t size = info.min_subgroup_size; size <= info.max_subgroup_size; size *= 2) {
        ScanRun setup(50'000, strategy(size));
        const Words values = make_values("wrapping", 50'000);
        expect_scanned(values, 49'999, setup.run(values, 49'999, false), false);
    }
}

TEST_P(ScanTeams, one_scan_of_another_in_a_recording_matches) {
    ScanRun setup(5000, strategy());
    const Words values = make_values("small", 5000);
    setup.counts.upload(values);
    setup.count.upload(Words{4000});
    const Buffer twice(setup.device, "twice", 5000 * 4);
    setup.commands.begin();
    setup.scan.record(setup.commands, setup.counts, setup.offsets, setup.count, 0, setup.total);
    setup.scan.record(setup.commands, setup.offsets, twice, setup.count, 0, setup.total);
    setup.commands.submit_and_wait();
    Words expected(4000);
    std::exclusive_scan(values.begin(), values.begin() + 4000, expected.begin(), 0U);
    std::exclusive_scan(expected.begin(), expected.end(), expected.begin(), 0U);
    EXPECT_EQ(twice.download<std::uint32_t>(4000), expected);
}

INSTANTIATE_TEST_SUITE_P(All, ScanTeams, ::testing::Bool(), [](const auto& param) {
    return param.param ? "team_is_thread" : "team_is_subgroup";
});

TEST(Scan, more_than_the_groups_of_the_device_is_an_error) {
    Device device{test::device_options()};
    for (const bool by_thread : {false, true}) {
        const Scan::Strategy strategy{by_thread, 0};
        const std::uint64_t most = Scan::max_capacity(device, strategy);
        EXPECT_GT(most, 1'000'000U);
        if (most >= 0xffffffffU) continue;
        EXPECT_THROW(Scan(device, static_cast<std::uint32_t>(most + 1), strategy), Error);
    }
}

TEST(Scan, validation_is_silent) {
    DeviceOptions options = test::device_options();
    options.validation = true;
    std::unique_ptr<Device> device;
    try {
        device = std::make_unique<Device>(options);
    } catch (const std::exception& error) {
        GTEST_SKIP() << error.what();
    }
    Scan scan(*device, 3000);
    Buffer counts(*device, "counts", 12'000), count(*device, "count", 4);
    const Buffer offsets(*device, "offsets", 12'000), total(*device, "total", 4);
    counts.upload(make_values("ones", 3000));
    count.upload(Words{3000});
    Commands commands(*device);
    for (int round = 0; round < 2; ++round) {
        commands.begin();
        commands.pass("scan");
        scan.record(commands, counts, offsets, count, 0, total);
        scan.record(commands, offsets, offsets, count, 0, total);
        commands.submit_and_wait();
    }
    EXPECT_EQ(device->validation_message_count(), 0U);
}

}  // namespace
}  // namespace darb
