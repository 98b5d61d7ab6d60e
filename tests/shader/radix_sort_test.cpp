// SPDX-License-Identifier: MIT
// RadixSort against std::stable_sort: adversarial sizes, keys and key bits, both scatter
// strategies, each with the offsets of the devices that take it, guard words behind all results.
#include "engine/primitives/radix_sort.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "engine/core/error.h"
#include "engine/core/rng.h"
#include "tests/support/scoped_variants.h"
#include "tests/support/test_device_options.h"

namespace darb {
namespace {

using Words = std::vector<std::uint32_t>;

constexpr std::uint32_t kGuard = 0xdeadbeef;
constexpr std::size_t kGuardWords = 64;

Words make_keys(const std::string& kind, std::size_t n) {
    Pcg32 rng(n + 7);
    Words keys(n);
    for (std::size_t i = 0; i < n; ++i) {
        const auto index = static_cast<std::uint32_t>(i);
        if (kind == "equal") keys[i] = 0x12345678;
        if (kind == "sorted") keys[i] = index * 37;
        if (kind == "reversed") keys[i] = static_cast<std::uint32_t>(n - i) * 41;
        if (kind == "random") keys[i] = rng.next();
        if (kind == "high_bits") keys[i] = rng.next() & 0xff000000;
        if (kind == "one_digit") keys[i] = 0xa5005a5a | (rng.below(256) << 16);
        if (kind == "few") keys[i] = rng.below(3) * 0x01010101;
        if (kind == "all_ones") keys[i] = 0xffffffff;
    }
    return keys;
}

struct Pairs {
    Words keys, values;
    bool operator==(const Pairs&) const = default;
};

struct SortRun {
    Device device{test::device_options()};
    test::ScopedVariants offsets;
    Commands commands{device};
    RadixSort sort;
    Buffer keys, values, count;

    SortRun(std::uint32_t capacity, SortScatter strategy, std::uint32_t subgroup_size = 0,
            int digit_bits = RadixSort::kDigitBits)
        : offsets(device, strategy == SortScatter::ballot ? "scan=subgroup" : "scan=thread"),
          sort(device, capacity, strategy, subgroup_size, digit_bits),
          keys(device, "keys", (capacity + kGuardWords) * 4),
          values(device, "values", (capacity + kGuardWords) * 4),
          count(device, "count", 16) {}

    // The whole buffers after sorting the first n pairs.
    Pairs run(Pairs pairs, std::uint32_t n, int key_bits, bool iota = false) {
        pairs.keys.resize(sort.capacity() + kGuardWords, kGuard);
        pairs.values.resize(sort.capacity() + kGuardWords, kGuard);
        keys.upload(pairs.keys);
        values.upload(pairs.values);
        count.upload(Words{kGuard, n, kGuard, kGuard});
        commands.begin();
        commands.pass("sort");
        sort.record(commands, keys, values, count, 4, key_bits, iota);
        commands.submit_and_wait();
        return {keys.download<std::uint32_t>(pairs.keys.size()),
                values.download<std::uint32_t>(pairs.values.size())};
    }
};

Pairs sorted_on_host(const Pairs& pairs, std::size_t n, int key_bits) {
    const std::uint32_t mask = key_bits == 32 ? ~0U : (1U << key_bits) - 1;
    std::vector<std::size_t> order(n);
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return (pairs.keys[a] & mask) < (pairs.keys[b] & mask);
    });
    Pairs result = pairs;
    for (std::size_t i = 0; i < n; ++i) {
        result.keys[i] = pairs.keys[order[i]];
        result.values[i] = pairs.values[order[i]];
    }
    return result;
}

void expect_sorted(SortRun& run, const Words& keys, std::uint32_t n, int key_bits,
                   const std::string& label) {
    Pairs pairs{keys, Words(keys.size())};
    for (std::size_t i = 0; i < keys.size(); ++i)
        pairs.values[i] = static_cast<std::uint32_t>(i) * 2654435761U;
    Pairs expected = sorted_on_host(pairs, std::min<std::size_t>(n, keys.size()), key_bits);
    expected.keys.resize(run.sort.capacity() + kGuardWords, kGuard);
    expected.values.resize(run.sort.capacity() + kGuardWords, kGuard);
    const Pairs got = run.run(pairs, n, key_bits);
    for (std::size_t i = 0; i < got.keys.size(); ++i) {
        ASSERT_EQ(got.keys[i], expected.keys[i]) << label << ", n " << n << ", key " << i;
        ASSERT_EQ(got.values[i], expected.values[i]) << label << ", n " << n << ", value " << i;
    }
}

class RadixStrategies : public ::testing::TestWithParam<SortScatter> {};

TEST_P(RadixStrategies, sizes_around_every_boundary_match) {
    SortRun run(70'000, GetParam());
    const std::uint32_t block = run.sort.block();
    const Words keys = make_keys("random", 70'000);
    for (const std::uint32_t n :
         {0U, 1U, 2U, 31U, 32U, 33U, 255U, 256U, 257U, block - 1, block, block + 1, 8191U, 8192U,
          8193U, 65'535U, 65'536U, 65'537U, 70'000U})
        expect_sorted(run, keys, n, 32, "random");
}

TEST_P(RadixStrategies, exact_capacity_writes_nothing_behind) {
    for (const std::uint32_t n : {1U, 2U, 33U, 4097U}) {
        SortRun run(n, GetParam());
        expect_sorted(run, make_keys("random", n), n, 32, "exact");
    }
}

TEST_P(RadixStrategies, keys_of_every_kind_match) {
    constexpr std::uint32_t kN = 30'011;
    SortRun run(kN, GetParam());
    for (const std::string kind :
         {"equal", "sorted", "reversed", "random", "high_bits", "one_digit", "few", "all_ones"})
        expect_sorted(run, make_keys(kind, kN), kN, 32, kind);
}

TEST_P(RadixStrategies, every_number_of_key_bits_matches) {
    constexpr std::uint32_t kN = 5003;
    SortRun run(kN, GetParam());
    const Words keys = make_keys("random", kN);
    for (int bits = 1; bits <= 32; ++bits)
        expect_sorted(run, keys, kN, bits, std::to_string(bits) + " bits");
}

TEST_P(RadixStrategies, iota_values_are_the_stable_order) {
    constexpr std::uint32_t kN = 20'000;
    SortRun run(kN, GetParam());
    for (const int bits : {5, 13, 20, 32}) {  // 1 to 4 passes
        Pairs pairs{make_keys("few", kN), Words(kN)};
        std::iota(pairs.values.begin(), pairs.values.end(), 0U);
        const Pairs expected = sorted_on_host(pairs, kN, bits);
        std::fill(pairs.values.begin(), pairs.values.end(), kGuard);
        Pairs got = run.run(pairs, kN, bits, true);
        got.keys.resize(kN);
        got.values.resize(kN);
        EXPECT_TRUE(got == expected) << bits << " bits";
    }
}

TEST_P(RadixStrategies, count_above_the_capacity_is_cut) {
    SortRun run(1000, GetParam());
    for (const std::uint32_t n : {1001U, 0xffffffffU})
        expect_sorted(run, make_keys("random", 1000), n, 32, "above");
}

TEST_P(RadixStrategies, a_million_pairs_match_and_repeat) {
    constexpr std::uint32_t kN = 1'100'003;  // rows of offsets longer than a workgroup
    SortRun run(kN, GetParam());
    expect_sorted(run, make_keys("random", kN), kN, 32, "random");
    const Pairs pairs{make_keys("one_digit", kN), make_keys("sorted", kN)};
    const Pairs first = run.run(pairs, kN, 24);
    EXPECT_TRUE(first == run.run(pairs, kN, 24));
}

TEST_P(RadixStrategies, every_subgroup_size_of_the_device_matches) {
    const DeviceInfo info = Device().info();
    for (std::uint32_t size = info.min_subgroup_size; size <= info.max_subgroup_size; size *= 2) {
        SortRun run(20'000, GetParam(), size);
        expect_sorted(run, make_keys("random", 20'000), 19'999, 32, std::to_string(size));
    }
}

TEST_P(RadixStrategies, digits_of_nine_bits_match) {
    const DeviceInfo info = Device().info();
    for (std::uint32_t size = info.min_subgroup_size; size <= info.max_subgroup_size; size *= 2) {
        SortRun run(20'000, GetParam(), size, RadixSort::kWideDigitBits);
        const Words keys = make_keys("random", 20'000);
        for (const int bits : {1, 8, 9, 10, 18, 19, 26, 27, 28, 32})
            expect_sorted(run, keys, 19'999, bits, std::to_string(bits) + " bits");
    }
}

TEST_P(RadixStrategies, pairs_in_the_scratch_buffers_come_out_sorted) {
    constexpr std::uint32_t kN = 20'000;
    SortRun run(kN, GetParam(), 0, RadixSort::kWideDigitBits);
    Pairs pairs{make_keys("random", kN), make_keys("sorted", kN)};
    for (std::uint32_t& key : pairs.keys) key >>= 5;  // 27 bits
    run.keys.upload(pairs.keys);
    run.values.upload(pairs.values);
    run.count.upload(Words{kN, 0, 0, 0});
    run.commands.begin();
    run.commands.copy(run.keys, run.sort.scratch_keys(), kN * 4);
    run.commands.copy(run.values, run.sort.scratch_values(), kN * 4);
    run.commands.fill(run.keys, kGuard);
    run.commands.pass("sort");
    run.sort.record_from_scratch(run.commands, run.keys, run.values, run.count, 0, 27);
    run.commands.submit_and_wait();
    const Pairs got{run.keys.download<std::uint32_t>(kN), run.values.download<std::uint32_t>(kN)};
    EXPECT_TRUE(got == sorted_on_host(pairs, kN, 27));
    EXPECT_TRUE(run.sort.is_odd(27));
    EXPECT_FALSE(run.sort.is_odd(32));
    EXPECT_THROW(run.sort.record_from_scratch(run.commands, run.keys, run.values, run.count, 0, 32),
                 Error);
}

INSTANTIATE_TEST_SUITE_P(All, RadixStrategies,
                         ::testing::Values(SortScatter::ballot, SortScatter::columns),
                         [](const auto& param) {
                             return param.param == SortScatter::ballot ? "ballot" : "columns";
                         });

TEST(RadixSort, automatic_is_columns_on_lavapipe_only) {
    Device device{test::device_options()};
    const RadixSort sort(device, 100);
    EXPECT_EQ(sort.scatter() == SortScatter::columns, device.is_lavapipe());
}

TEST(RadixSort, validation_is_silent) {
    DeviceOptions options = test::device_options();
    options.validation = true;
    std::unique_ptr<Device> device;
    try {
        device = std::make_unique<Device>(options);
    } catch (const std::exception& error) {
        GTEST_SKIP() << error.what();
    }
    for (const auto strategy : {SortScatter::ballot, SortScatter::columns}) {
        RadixSort sort(*device, 9000, strategy);
        Buffer keys(*device, "keys", 36'000), count(*device, "count", 4);
        const Buffer values(*device, "values", 36'000);
        keys.upload(make_keys("random", 9000));
        count.upload(Words{9000});
        Commands commands(*device);
        for (const int bits : {8, 16}) {
            commands.begin();
            commands.pass("sort");
            sort.record(commands, keys, values, count, 0, bits, true);
            commands.submit_and_wait();
        }
    }
    EXPECT_EQ(device->validation_message_count(), 0U);
}

}  // namespace
}  // namespace darb
