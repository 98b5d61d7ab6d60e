// SPDX-License-Identifier: MIT
// TileLists against a stable sort on the host and against the radix sort, guard words behind all
// results; and frames whose pictures have more tiles than can be counted.
#include "engine/raster/tile_lists.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "engine/core/error.h"
#include "engine/core/rng.h"
#include "engine/primitives/radix_sort.h"
#include "engine/raster/frame_buffers.h"
#include "shaders/shared/render_args.h"
#include "tests/support/scoped_variants.h"
#include "tests/support/test_walk.h"

namespace darb::test {
namespace {

using Words = std::vector<std::uint32_t>;

constexpr std::uint32_t kListGuard = 0xdeadbeef, kListGuardWords = 64;

struct Lists {
    Words sorted, ranges;
    gpu::FrameStatus status{};
};

Lists lists_on_host(const Words& tiles, std::uint32_t tile_count) {
    Lists lists;
    lists.sorted.resize(tiles.size());
    std::iota(lists.sorted.begin(), lists.sorted.end(), 0u);
    std::stable_sort(lists.sorted.begin(), lists.sorted.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return tiles[a] < tiles[b]; });
    lists.ranges.assign(2 * std::size_t{tile_count}, 0);
    for (std::uint32_t i = 0; i < lists.sorted.size(); ++i) {
        const std::uint32_t tile = tiles[lists.sorted[i]];
        std::uint32_t* range = &lists.ranges[2 * std::size_t{tile}];
        if (range[1] == 0) range[0] = i;
        range[1] = i + 1;
        lists.status.longest_list = std::max(lists.status.longest_list, range[1] - range[0]);
    }
    return lists;
}

Lists lists_on_device(const Words& tiles, std::uint32_t tile_count, std::uint32_t capacity,
                      std::uint32_t list_capacity) {
    Device& device = shared_device();
    TileLists lists(device, capacity, tile_count);
    Buffer count(device, "count", 4), tile(device, "tile", capacity * 4u),
        sorted(device, "sorted", (capacity + kListGuardWords) * 4u),
        range(device, "range", (2 * tile_count + kListGuardWords) * 4u),
        status(device, "status", sizeof(gpu::FrameStatus));
    Words padded = tiles;
    padded.resize(capacity, 0);  // beyond the count: no list may have them
    tile.upload(padded);
    count.upload(Words{static_cast<std::uint32_t>(tiles.size())});
    sorted.upload(Words(capacity + kListGuardWords, kListGuard));
    range.upload(Words(2 * tile_count + kListGuardWords, kListGuard));
    status.upload(std::vector<gpu::FrameStatus>(1));
    Commands commands(device);
    commands.begin();
    commands.pass("tile sort");
    lists.record(commands, {count, tile, sorted, range, status}, tile_count, list_capacity);
    commands.submit_and_wait();
    Lists got;
    got.sorted = sorted.download<std::uint32_t>(capacity + kListGuardWords);
    got.ranges = range.download<std::uint32_t>(2 * tile_count + kListGuardWords);
    got.status = status.download<gpu::FrameStatus>(1)[0];
    for (std::size_t i = tiles.size(); i < got.sorted.size(); ++i)
        EXPECT_EQ(got.sorted[i], kListGuard) << "place " << i << " is in no list";
    for (std::size_t i = 2 * std::size_t{tile_count}; i < got.ranges.size(); ++i)
        EXPECT_EQ(got.ranges[i], kListGuard) << "word " << i << " is of no tile";
    got.sorted.resize(tiles.size());
    got.ranges.resize(2 * std::size_t{tile_count});
    return got;
}

Words tiles_of(const std::string& kind, std::size_t n, std::uint32_t tile_count) {
    Pcg32 random(n + tile_count);
    Words tiles(n);
    for (std::size_t i = 0; i < n; ++i) {
        if (kind == "random") tiles[i] = random.below(tile_count);
        if (kind == "one") tiles[i] = tile_count / 2;
        if (kind == "last") tiles[i] = tile_count - 1;
        if (kind == "rows") tiles[i] = static_cast<std::uint32_t>(i % tile_count);
        if (kind == "few") tiles[i] = random.below(3) * (tile_count - 1) / 2;
        if (kind == "reversed")
            tiles[i] = tile_count - 1 - static_cast<std::uint32_t>(i * tile_count / n);
    }
    return tiles;
}

TEST(TileLists, are_those_of_a_stable_sort) {
    for (const std::uint32_t tile_count : {1u, 2u, 63u, 4096u, 4097u, 6700u, 8192u})
        for (const std::size_t n : {std::size_t{0}, std::size_t{1}, std::size_t{31},
                                    std::size_t{LIST_BLOCK}, std::size_t{5 * LIST_BLOCK + 77}})
            for (const char* kind : {"random", "one", "last", "rows", "few", "reversed"}) {
                SCOPED_TRACE(fmt::format("{} of {} tiles, {}", n, tile_count, kind));
                const Words tiles = tiles_of(kind, n, tile_count);
                const Lists host = lists_on_host(tiles, tile_count);
                const auto capacity = static_cast<std::uint32_t>(n + 3 * LIST_BLOCK / 2);
                const Lists device =
                    lists_on_device(tiles, tile_count, capacity, host.status.longest_list);
                ASSERT_EQ(device.sorted, host.sorted);
                ASSERT_EQ(device.ranges, host.ranges);
                EXPECT_EQ(device.status.longest_list, host.status.longest_list);
                EXPECT_EQ(device.status.overflow, 0u);
            }
}

TEST(TileLists, have_the_order_of_the_radix_sort) {
    constexpr std::uint32_t n = 100'003, tile_count = 6700;
    const Words tiles = tiles_of("random", n, tile_count);
    const Lists counted = lists_on_device(tiles, tile_count, n, n);
    Device& device = shared_device();
    RadixSort sort(device, n);
    Buffer count(device, "count", 4), keys(device, "keys", n * 4), values(device, "values", n * 4);
    count.upload(Words{n});
    keys.upload(tiles);
    Commands commands(device);
    commands.begin();
    commands.pass("sort");
    sort.record(commands, keys, values, count, 0, 13, true);
    commands.submit_and_wait();
    EXPECT_EQ(counted.sorted, values.download<std::uint32_t>(n));
}

TEST(TileLists, a_tile_that_the_picture_has_not_is_in_no_list) {
    Words tiles = tiles_of("random", 20'000, 500);
    std::size_t left = 0;
    for (std::size_t i = 0; i < tiles.size(); ++i) {
        if (i % 7 == 0) tiles[i] = i % 2 == 0 ? 500 : 0xFFFFFFFFu;
        left += tiles[i] < 500 ? 1 : 0;
    }
    Device& device = shared_device();
    TileLists lists(device, 20'000, 500);
    Buffer count(device, "count", 4), tile(device, "tile", 80'000),
        sorted(device, "sorted", 80'000), range(device, "range", 4'000),
        status(device, "status", sizeof(gpu::FrameStatus));
    tile.upload(tiles);
    count.upload(Words{20'000});
    status.upload(std::vector<gpu::FrameStatus>(1));
    Commands commands(device);
    commands.begin();
    commands.pass("tile sort");
    lists.record(commands, {count, tile, sorted, range, status}, 500, 20'000);
    commands.submit_and_wait();
    const Words ranges = range.download<std::uint32_t>(1'000),
                got = sorted.download<std::uint32_t>(left);
    EXPECT_EQ(ranges.back(), left);
    for (std::uint32_t t = 0; t < 500; ++t)
        for (std::uint32_t i = ranges[2 * t]; i < ranges[2 * t + 1]; ++i)
            ASSERT_EQ(tiles[got[i]], t) << "place " << i;
}

TEST(TileLists, a_list_beyond_what_the_blends_take_raises_the_flag) {
    const Words tiles = tiles_of("one", 1000, 9);
    EXPECT_EQ(lists_on_device(tiles, 9, 1000, 999).status.overflow, OVERFLOW_LISTS);
    EXPECT_EQ(lists_on_device(tiles, 9, 1000, 1000).status.overflow, 0u);
}

TEST(TileLists, what_does_not_fit_is_refused) {
    DeviceInfo info = shared_device().info();
    EXPECT_TRUE(TileLists::fits(info, 1'000'000, 8192));
    EXPECT_FALSE(TileLists::fits(info, 1'000'000, 8193));
    EXPECT_FALSE(TileLists::fits(info, 1'000'000, 0));
    info.shared_memory_bytes = 16 * 1024;
    EXPECT_TRUE(TileLists::fits(info, 1'000'000, 4096));
    EXPECT_FALSE(TileLists::fits(info, 1'000'000, 4097)) << "a counter for each in 16 KiB";
    info.max_storage_buffer_bytes = 1'000'000;
    EXPECT_FALSE(TileLists::fits(info, 1'000'000, 4096)) << "the table of counts takes 2 MB";
    EXPECT_THROW(TileLists(shared_device(), 1000, 8193), Error);
    EXPECT_THROW(TileLists(shared_device(), 0, 1), Error);
}

// 2,064 x 1,040 px have 8,385 tiles.
TEST(TileLists, frames_with_more_tiles_sort_by_digits) {
    const TestScene large = random_scene({.count = 40,
                                          .width = 2064,
                                          .height = 1040,
                                          .sh_degree = 0,
                                          .min_log_scale = -3,
                                          .seed = 4});
    const TestScene small = random_scene(
        {.count = 40, .width = 300, .height = 200, .sh_degree = 0, .min_log_scale = -3, .seed = 4});
    const auto pictures = [&] {
        Renderer renderer(shared_device(), large.model);
        std::vector<std::vector<float>> data;
        data.push_back(renderer.render(small.camera).data);
        data.push_back(renderer.render(large.camera).data);
        data.push_back(renderer.render(small.camera).data);
        return data;
    };
    const auto usual = pictures();
    const ScopedVariants variants(shared_device(), "lists=counts");
    EXPECT_EQ(pictures(), usual);
}

// What the forecast says is what a frame takes, in both forms.
TEST(TileLists, their_memory_is_in_the_forecast) {
    Device& device = shared_device();
    const auto taken = [&](const char* form, int width, int height) {
        const ScopedVariants variants(device, form);
        const std::uint64_t before = device.allocated_bytes();
        FrameBuffers buffers(device, {});
        buffers.reserve(5'000, 100'000, width, height);
        const FrameBytes bytes = FrameBuffers::device_bytes(device, {}, buffers.size());
        EXPECT_EQ(device.allocated_bytes() - before,
                  bytes.splats + bytes.intersections + bytes.images)
            << form << ", " << width << " x " << height;
        return bytes.intersections;
    };
    EXPECT_LT(taken("lists=counts", 800, 600), taken("lists=digits", 800, 600));
    EXPECT_EQ(taken("lists=counts", 2064, 1040), taken("lists=digits", 2064, 1040))
        << "too many tiles to count";
}

}  // namespace
}  // namespace darb::test
