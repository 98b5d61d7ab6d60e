// SPDX-License-Identifier: MIT
// The arithmetic of limits on devices that bind 128 MiB and 4 GiB, the least and the most that
// Vulkan has: nothing wraps at 32 bits. No memory of these sizes is taken.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "engine/core/error.h"
#include "engine/gpu/device_state.h"
#include "engine/raster/attribute_rows.h"
#include "engine/raster/blend_backward.h"
#include "engine/raster/forward.h"
#include "engine/raster/frame_buffers.h"
#include "engine/raster/frame_view.h"
#include "engine/raster/gpu_splats.h"
#include "tests/support/test_device_options.h"
#include "trainer/step/memory_plan.h"

namespace darb {
namespace {

constexpr std::uint64_t kLeast = std::uint64_t{1} << 27;
constexpr std::uint64_t kMost =
    std::numeric_limits<std::uint32_t>::max();  // the most that maxStorageBufferRange can say
constexpr std::uint64_t kTebibyte = std::uint64_t{1} << 40;

struct Sized {
    Device device;
    Sized(std::uint64_t binding, std::uint64_t allocation, std::uint32_t groups)
        : device(options(binding, allocation)) {
        device.state().info.max_groups_x = groups;
        device.state().tuning.scatter = SortScatter::ballot;
    }
    static DeviceOptions options(std::uint64_t binding, std::uint64_t allocation) {
        DeviceOptions options = test::device_options();
        options.faults = parse_faults(fmt::format("binding:{},allocation:{}", binding, allocation));
        return options;
    }
};

TEST(LargeBinding, intersections_and_splats_are_those_that_the_bindings_hold) {
    const auto most = [](std::uint64_t binding, std::uint64_t allocation, BackwardBlend way) {
        const Sized sized(binding, allocation, 0x7FFFFFFFu);
        return FrameBuffers::max_intersections(sized.device, way);
    };
    // Five windows of 32 bytes an intersection, but no more than one allocation holds.
    EXPECT_EQ(most(kLeast, kTebibyte, BackwardBlend::team), 5 * (kLeast / 32));
    EXPECT_EQ(most(kMost, kTebibyte, BackwardBlend::team), 5 * 134'217'720U);
    EXPECT_EQ(most(kMost, kMost, BackwardBlend::subgroup), 134'217'727U);
    EXPECT_EQ(most(kMost, std::numeric_limits<std::int64_t>::max(), BackwardBlend::team),
              5 * 134'217'720U);
    const Sized large(kMost, kTebibyte, 0x7FFFFFFFu);
    EXPECT_EQ(FrameBuffers::max_intersections(large.device, BackwardBlend::buckets),
              (kMost / 4096 / 2) * bucket_length(large.device));
    EXPECT_EQ(GpuSplats::max_count(large.device, 3, true), kMost / 32);
    EXPECT_EQ(GpuSplats::max_count(large.device, 0, false), kMost / 16);
    const Sized narrow(kLeast, kMost, 65'535);
    EXPECT_EQ(GpuSplats::max_count(narrow.device, 3, true), kLeast / 32);
    // What steps ask for at least, four intersections a splat, is still a number of 32 bits.
    EXPECT_LE(std::uint64_t{GpuSplats::max_count(large.device, 0, false)} * 4, kMost);
}

TEST(LargeBinding, ranges_of_splats_cover_all_and_stay_within_a_binding) {
    for (const std::uint64_t binding : {kLeast, kMost})
        for (const std::uint32_t floats : {1U, 3U, 4U, 48U, 96U}) {
            SCOPED_TRACE(fmt::format("{} bytes, {} floats", binding, floats));
            const std::uint32_t count = 268'435'455;
            const AttributeRows rows{floats, floats % 4 == 0 ? floats / 4 : 0};
            std::uint64_t next = 0;
            for (const SplatRange& range : splat_ranges(count, rows.floats_held(), binding)) {
                ASSERT_EQ(range.first, next);
                next += range.count;
                ASSERT_LE(rows.bytes(range.count), binding);
                ASSERT_EQ(std::uint64_t{range.first} * floats * 4 % 256, 0U);
            }
            EXPECT_EQ(next, count);
        }
}

TEST(LargeBinding, memory_grows_with_what_the_bindings_hold) {
    const Sized large(kMost, kTebibyte, 0x7FFFFFFFu);
    MemoryDemand demand;
    demand.width = 18'918, demand.height = 18'918;  // the most that three floats a pixel allow
    demand.image_pixels = std::uint64_t{18'918} * 18'918;
    demand.photo_pixels = 300 * demand.image_pixels;
    const auto bytes = [&](std::uint64_t splats, std::uint64_t intersections) {
        demand.splats = splats, demand.intersections = intersections;
        const MemoryPlan plan = plan_memory(large.device, demand);
        return plan.parameters + plan.moments + plan.frame + plan.intersections;
    };
    const std::uint64_t splats = GpuSplats::max_count(large.device, 3, true),
                        k = FrameBuffers::max_intersections(large.device);
    const auto all = static_cast<double>(bytes(splats, k)),
               half = static_cast<double>(bytes(splats / 2, k / 2));
    EXPECT_NEAR(all / half, 2, 1e-3);
    EXPECT_GT(all, 32.0 * static_cast<double>(k) + 700.0 * static_cast<double>(splats));
    EXPECT_EQ(plan_memory(large.device, demand).photos, 300 * 4 * demand.image_pixels);
    EXPECT_EQ(max_frame_pixels(large.device), kMost / 12);
}

TEST(LargeBinding, a_frame_that_is_too_large_names_a_width_that_fits) {
    for (const std::uint64_t binding : {kLeast, kMost}) {
        const Sized sized(binding, kTebibyte, 65'535);
        const std::uint64_t most = max_frame_pixels(sized.device);
        const int side = static_cast<int>(std::sqrt(double(most)));
        EXPECT_NO_THROW(check_frame(sized.device, side, side));
        try {
            check_frame(sized.device, 2 * side, 2 * side);
            ADD_FAILURE() << "no error";
        } catch (const Error& e) {
            EXPECT_NE(std::string(e.what()).find(fmt::format("at most {} ", side - 2)),
                      std::string::npos)
                << e.what();
        }
    }
}

}  // namespace
}  // namespace darb
