// SPDX-License-Identifier: MIT
// Commands and Pipeline: fills, copies, dispatches, barriers under validation, timestamps.
#include "engine/gpu/commands.h"
#include "engine/gpu/shader_table.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "engine/core/error.h"
#include "engine/gpu/barriers.h"
#include "engine/gpu/pipeline.h"
#include "engine/gpu/spirv_reflect.h"
#include "shaders/shared/scan_args.h"
#include "tests/support/test_device_options.h"

namespace darb {
namespace {

constexpr VkPipelineStageFlags2 kCompute = VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT;
constexpr VkAccessFlags2 kRead = VK_ACCESS_2_SHADER_STORAGE_READ_BIT;
constexpr VkAccessFlags2 kWrite = VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT;

VkBuffer fake_buffer(std::uintptr_t id) {
    return reinterpret_cast<VkBuffer>(id);
}

bool waits(BarrierTracker& tracker, std::uintptr_t id, VkAccessFlags2 read, VkAccessFlags2 write,
           VkPipelineStageFlags2 stage = kCompute) {
    tracker.use({fake_buffer(id), stage, read, write});
    return tracker.resolve().has_value();
}

TEST(BarrierTracker, read_after_write_waits_once_and_write_waits_for_readers) {
    BarrierTracker tracker;
    EXPECT_FALSE(waits(tracker, 1, 0, kWrite)) << "first write";
    EXPECT_TRUE(waits(tracker, 1, kRead, 0)) << "read after write";
    EXPECT_FALSE(waits(tracker, 1, kRead, 0)) << "second read";
    EXPECT_FALSE(waits(tracker, 2, kRead, 0)) << "another buffer";
    EXPECT_TRUE(waits(tracker, 1, 0, kWrite)) << "write after read";
    EXPECT_TRUE(waits(tracker, 1, kRead, kWrite)) << "write after write";
    tracker.clear();
    EXPECT_FALSE(waits(tracker, 1, kRead, 0)) << "after clear";
}

TEST(BarrierTracker, what_was_announced_and_never_recorded_is_forgotten_too) {
    BarrierTracker tracker;
    tracker.use({fake_buffer(1), kCompute, 0, kWrite});
    tracker.clear();
    EXPECT_FALSE(waits(tracker, 2, kRead, 0));
    EXPECT_FALSE(waits(tracker, 1, kRead, 0)) << "written by a pass that was never recorded";
    EXPECT_FALSE(tracker.to_host().has_value());
}

TEST(BarrierTracker, one_barrier_does_for_all_that_came_before) {
    BarrierTracker tracker;
    waits(tracker, 1, 0, kWrite);
    waits(tracker, 2, 0, kWrite);
    waits(tracker, 3, kRead, 0);
    ASSERT_TRUE(waits(tracker, 1, kRead, 0));
    EXPECT_FALSE(waits(tracker, 2, kRead, 0)) << "written before the barrier";
    EXPECT_FALSE(waits(tracker, 3, 0, kWrite)) << "read before the barrier";
    EXPECT_TRUE(waits(tracker, 2, 0, kWrite)) << "read after the barrier";
    EXPECT_FALSE(waits(tracker, 1, 0, kWrite)) << "before the second barrier";
    EXPECT_FALSE(waits(tracker, 3, kRead, 0)) << "written before the second barrier";
    EXPECT_TRUE(waits(tracker, 1, kRead, 0)) << "written after it";
}

TEST(BarrierTracker, reader_in_another_stage_waits_too) {
    BarrierTracker tracker;
    constexpr VkPipelineStageFlags2 kIndirect = VK_PIPELINE_STAGE_2_DRAW_INDIRECT_BIT;
    waits(tracker, 1, 0, kWrite);
    waits(tracker, 1, kRead, 0);
    tracker.use({fake_buffer(1), kIndirect, VK_ACCESS_2_INDIRECT_COMMAND_READ_BIT, 0});
    const auto barrier = tracker.resolve();
    ASSERT_TRUE(barrier.has_value());
    EXPECT_EQ(barrier->srcAccessMask, kWrite);
    EXPECT_EQ(barrier->dstStageMask, kIndirect);
    EXPECT_EQ(barrier->dstAccessMask, VK_ACCESS_2_INDIRECT_COMMAND_READ_BIT);
    ASSERT_TRUE(waits(tracker, 1, 0, kWrite)) << "a write waits for the indirect read, too";
    EXPECT_TRUE(
        waits(tracker, 1, VK_ACCESS_2_TRANSFER_READ_BIT, 0, VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT));
}

TEST(BarrierTracker, uses_of_one_buffer_in_one_pass_are_one) {
    BarrierTracker tracker;
    tracker.use({fake_buffer(1), kCompute, kRead, 0});
    tracker.use({fake_buffer(1), kCompute, 0, kWrite});
    EXPECT_FALSE(tracker.resolve().has_value());
    EXPECT_TRUE(waits(tracker, 1, kRead, 0));
}

ShaderInterface interface_of(std::string_view name) {
    for (const ShaderBinary& shader : shader_table())
        if (shader.name == name) return reflect_spirv(shader.words, name);
    ADD_FAILURE() << "no shader " << name;
    return {};
}

TEST(ReflectSpirv, scan_apply_has_its_bindings_and_constants) {
    const ShaderInterface shader = interface_of("scan_apply");
    ASSERT_EQ(shader.bindings.size(), 4U);
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_EQ(shader.bindings[i].binding, i);
        EXPECT_TRUE(shader.bindings[i].storage_buffer);
        EXPECT_TRUE(shader.bindings[i].reads) << i;  // the last one in place
        EXPECT_EQ(shader.bindings[i].writes, i == 3) << i;
    }
    const ShaderInterface::Binding sums = interface_of("scan_reduce").bindings.at(2);
    EXPECT_TRUE(sums.writes && !sums.reads);
    ASSERT_EQ(shader.constants.size(), 4U);
    EXPECT_EQ(shader.constants[0].name, "THREADS");
    EXPECT_EQ(shader.constants[0].default_bits, 32U);
    EXPECT_EQ(shader.constants[2].name, "TEAM_IS_THREAD");
    EXPECT_EQ(shader.constants[2].type, ShaderInterface::ScalarType::boolean);
    EXPECT_EQ(shader.local_size_spec_id[0], 0);
    EXPECT_EQ(shader.push_constant_bytes, 0U);
}

TEST(ReflectSpirv, subgroups_are_asked_for_where_they_are_used) {
    EXPECT_TRUE(interface_of("blend_backward").uses_subgroups);
    EXPECT_TRUE(interface_of("project").uses_subgroups);
    EXPECT_FALSE(interface_of("tile_ranges").uses_subgroups);
    EXPECT_FALSE(interface_of("adam_update").uses_subgroups);
}

TEST(ReflectSpirv, every_shader_of_the_table_is_readable) {
    for (const ShaderBinary& shader : shader_table()) {
        const ShaderInterface shader_interface = reflect_spirv(shader.words, shader.name);
        EXPECT_LE(shader_interface.push_constant_bytes, 128U) << shader.name;
        EXPECT_GE(shader_interface.bindings.size(), 1U) << shader.name;
    }
    EXPECT_EQ(interface_of("scan_prepare").push_constant_bytes, sizeof(gpu::ScanPrepareArgs));
}

TEST(Pipeline, spec_constants_are_set_by_name) {
    Device device{test::device_options()};
    const Pipeline pipeline(device, "scan_top", {{"THREADS", 64}});
    EXPECT_EQ(pipeline.threads_x(), 64U);
    EXPECT_TRUE(pipeline.declares("THREADS"));
    EXPECT_FALSE(pipeline.declares("NOT_THERE"));
}

TEST(Pipeline, equal_ones_of_a_device_are_one_while_it_lives) {
    Device device{test::device_options()};
    const Pipeline first(device, "scan_top", {{"THREADS", 64}});
    {
        const Pipeline same(device, "scan_top", {{"THREADS", 64}}), other(device, "scan_top");
        EXPECT_EQ(same.handle(), first.handle());
        EXPECT_EQ(Pipeline(device, "scan_top", for_several_passes({{"CHUNK", 8}, {"THREADS", 64}}))
                      .handle(),
                  first.handle())
            << "CHUNK is for other passes of the table";
        EXPECT_NE(other.handle(), first.handle());
        EXPECT_EQ(live_pipelines(device).size(), 2U);
    }
    ASSERT_EQ(live_pipelines(device).size(), 1U);
    Device second{test::device_options()};
    const Pipeline anew(second, live_pipelines(device).front());
    EXPECT_EQ(anew.threads_x(), 64U);
    EXPECT_EQ(live_pipelines(second), live_pipelines(device));
}

TEST(Pipeline, one_that_nobody_uses_stays_where_the_device_keeps_them) {
    DeviceOptions options = test::device_options();
    options.keep_pipelines = true;
    Device device{options};
    const VkPipeline first = Pipeline(device, "scan_top", {{"THREADS", 64}}).handle();
    ASSERT_EQ(live_pipelines(device).size(), 1U);
    EXPECT_EQ(Pipeline(device, "scan_top", {{"THREADS", 64}}).handle(), first);
}

TEST(Pipeline, the_driver_may_choose_the_size_of_subgroups) {
    Device device{test::device_options()};
    const Pipeline own(device, "scan_reduce"),
        any(device, "scan_reduce", {}, true, kAnySubgroupSize);
    EXPECT_TRUE(any);
    EXPECT_EQ(live_pipelines(device).size(), 2U);
    EXPECT_EQ(any.threads_x(), own.threads_x());
}

TEST(PipelineDeathTest, unknown_shader_aborts_with_its_name) {
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    Device device{test::device_options()};
    EXPECT_DEATH(Pipeline(device, "no_such_shader"), "no_such_shader");
}

// What the build read from the text of the shaders is what their SPIR-V declares.
TEST(ConstantNames, are_those_that_the_shaders_declare) {
    std::set<std::string> declared;
    for (const ShaderBinary& shader : shader_table())
        for (const auto& constant : reflect_spirv(shader.words, shader.name).constants)
            declared.insert(constant.name);
    EXPECT_EQ(std::set<std::string>(std::begin(kConstantNames), std::end(kConstantNames)),
              declared);
}

TEST(PipelineDeathTest, a_constant_that_the_shader_does_not_declare_aborts_with_both_names) {
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    Device device{test::device_options()};
    EXPECT_DEATH(Pipeline(device, "scan_top", {{"SEGMENT", 64}}),
                 "scan_top declares no specialization constant SEGMENT; it declares THREADS");
    EXPECT_DEATH(Pipeline(device, "scan_prepare", {{"THREADS", 64}}), "it declares none");
}

TEST(CommandsDeathTest, wrong_buffers_or_arguments_abort) {
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    Device device{test::device_options()};
    const Pipeline pipeline(device, "scan_prepare");
    const Buffer buffer(device, "buffer", 64);
    Commands commands(device);
    commands.begin();
    EXPECT_DEATH(commands.dispatch(pipeline, gpu::ScanPrepareArgs{}, {buffer}, 1), "binds 1");
    EXPECT_DEATH(commands.dispatch(pipeline, NoArgs{}, {buffer, buffer}, 1), "given 1 bytes");
    EXPECT_DEATH(commands.dispatch(pipeline, gpu::ScanPrepareArgs{}, {buffer, buffer}, 0),
                 "0 x 1 x 1 groups");
}

TEST(Commands, dispatch_reads_what_a_fill_wrote) {
    Device device{test::device_options()};
    const Pipeline pipeline(device, "scan_prepare");
    const Buffer count(device, "count", 8), plan(device, "plan", sizeof(gpu::ScanPlan));
    Commands commands(device);
    for (std::uint32_t round = 1; round < 4; ++round) {
        commands.begin();
        commands.pass("fill");
        commands.fill(count, 1000 * round);
        commands.pass("prepare");
        commands.dispatch(pipeline, gpu::ScanPrepareArgs{2500, 1, 256, 2}, {count, plan}, 1);
        commands.submit_and_wait();
        const auto got = plan.download<gpu::ScanPlan>(1)[0];
        const std::uint32_t expected = std::min(1000 * round, 2500U);
        EXPECT_EQ(got.count, expected);
        EXPECT_EQ(got.chunks, (expected + 255) / 256);
        EXPECT_EQ(got.groups_x, (got.chunks + 1) / 2);
    }
}

TEST(Commands, pass_times_have_a_row_per_pass_in_order) {
    Device device{test::device_options()};
    const Buffer buffer(device, "buffer", 1 << 20);
    Commands commands(device);
    commands.begin();
    for (int i = 0; i < 300; ++i) {  // more than one query pool
        commands.pass("pass " + std::to_string(i));
        commands.fill(buffer, static_cast<std::uint32_t>(i));
    }
    commands.submit_and_wait();
    const std::vector<PassTime> times = commands.pass_times();
    if (device.info().timestamp_period_ns == 0) GTEST_SKIP() << "no timestamps on this queue";
    ASSERT_EQ(times.size(), 300U);
    EXPECT_EQ(times[299].name, "pass 299");
    for (const PassTime& time : times) {
        EXPECT_GE(time.ms, 0) << time.name;
    }
}

// Intel's GPUs have 36 bits, others none; the counter may go over between two of them.
TEST(Commands, pass_times_with_few_bits_and_without_timestamps) {
    for (const std::uint32_t bits : {36U, 0U}) {
        DeviceOptions options = test::device_options();
        options.faults.timestamp_bits = bits;
        Device device(options);
        const Buffer buffer(device, "buffer", 1 << 20);
        Commands commands(device);
        commands.begin();
        commands.pass("fill");
        commands.fill(buffer, 1);
        commands.submit_and_wait();
        const std::vector<PassTime> times = commands.pass_times();
        if (bits == 0 || device.info().timestamp_period_ns == 0) {
            EXPECT_TRUE(times.empty());
            continue;
        }
        ASSERT_EQ(times.size(), 1U);
        EXPECT_GT(times[0].ms, 0);
        EXPECT_LT(times[0].ms, 10'000) << "less than 2^36 ns";
    }
}

TEST(TickDifference, counts_on_where_the_counter_begins_anew) {
    EXPECT_EQ(tick_difference(5, 9, 64), 4U);
    EXPECT_EQ(tick_difference((std::uint64_t{1} << 36) - 2, 3, 36), 5U);
    EXPECT_EQ(tick_difference(~std::uint64_t{0}, 0, 64), 1U);
    // Bits above those that are valid may hold anything.
    EXPECT_EQ(tick_difference(0xa000000000000005, 0x7000000000000009, 36), 4U);
}

TEST(Commands, copies_and_fills_in_a_chain_are_ordered_and_validation_is_silent) {
    DeviceOptions options = test::device_options();
    options.validation = true;
    std::unique_ptr<Device> device;
    try {
        device = std::make_unique<Device>(options);
    } catch (const Error& error) {
        GTEST_SKIP() << error.what();
    }
    const Pipeline pipeline(*device, "scan_prepare");
    const Buffer a(*device, "a", 4096), b(*device, "b", 4096), plan(*device, "plan", 32);
    const Buffer result(*device, "result", 4096, Memory::host);
    Commands commands(*device);
    for (int round = 0; round < 2; ++round) {
        commands.begin();
        commands.pass("chain");
        commands.fill(a, 1);
        commands.copy(a, b, 4096);                   // read after write
        commands.fill(a, 2);                         // write after read
        commands.fill(BufferRange(a, 512, 512), 3);  // write after write
        commands.copy(a, BufferRange(b, 256), 1024);
        const gpu::ScanPrepareArgs args{100, 0, 10, 1};
        commands.dispatch(pipeline, args, {b, plan}, 1);
        commands.dispatch_indirect(pipeline, args, {b, BufferRange(a, 2048)}, plan, 0);
        commands.fill(plan, 0);
        commands.copy(b, result, 4096);
        commands.submit_and_wait();
    }
    const auto* words = static_cast<const std::uint32_t*>(result.mapped());
    EXPECT_EQ(words[0], 1U);
    EXPECT_EQ(words[64], 2U);
    EXPECT_EQ(words[64 + 128], 3U);
    EXPECT_EQ(words[1023], 1U);
    EXPECT_EQ(device->validation_message_count(), 0U);
}

TEST(Commands, many_dispatches_grow_the_descriptor_pools) {
    Device device{test::device_options()};
    const Pipeline pipeline(device, "scan_prepare");
    const Buffer count(device, "count", 16), plan(device, "plan", 32);
    Commands commands(device);
    for (int round = 0; round < 2; ++round) {
        commands.begin();
        commands.fill(count, 7);
        for (int i = 0; i < 600; ++i)
            commands.dispatch(pipeline, gpu::ScanPrepareArgs{9, 0, 1, 1}, {count, plan}, 1);
        commands.submit_and_wait();
    }
    EXPECT_EQ(plan.download<gpu::ScanPlan>(1)[0].count, 7U);
}

TEST(Commands, binding_more_than_the_device_allows_is_an_error) {
    Device device{test::device_options()};
    if (device.info().max_storage_buffer_bytes > (std::uint64_t{1} << 28)) GTEST_SKIP();
    const std::uint64_t bytes = device.info().max_storage_buffer_bytes + 4096;
    const Buffer large(device, "large", bytes), plan(device, "plan", 32);
    const Pipeline pipeline(device, "scan_prepare");
    Commands commands(device);
    commands.begin();
    commands.pass("prepare");
    const gpu::ScanPrepareArgs args{9, 0, 1, 1};
    try {
        commands.dispatch(pipeline, args, {large, plan}, 1);
        FAIL() << "no error";
    } catch (const Error& error) {
        EXPECT_EQ(error.where, "pass \"prepare\"");
        EXPECT_NE(error.reason.find("\"large\""), std::string::npos) << error.reason;
    }
}

// Through two images, the second twice as large, and back.
TEST(Commands, images_are_copied_scaled_and_cleared_in_order) {
    Device device;
    constexpr VkFormat kFormat = VK_FORMAT_B8G8R8A8_UNORM;
    const std::vector<std::uint32_t> texels = {0x01020304, 0xFF000000, 0x00FF00FF, 0xFFFFFFFF};
    Buffer from(device, "from", 16);
    from.upload(texels);
    const Buffer small_back(device, "back", 16, Memory::host), large_back(device, "back", 64);
    DeviceImage small(device, "small", 2, 2, kFormat), large(device, "large", 4, 4, kFormat);
    Commands commands(device);
    for (int again = 0; again < 2; ++again) {  // layouts go on from the recording before
        commands.begin();
        commands.clear(small, {1, 0, 0, 1});
        commands.copy(from, small);
        commands.copy(small, large, VK_FILTER_NEAREST);
        commands.copy(small, small_back);
        commands.copy(large, large_back);
        commands.submit_and_wait();
    }
    EXPECT_EQ(small_back.download<std::uint32_t>(4), texels);
    const auto* mapped = static_cast<const std::uint32_t*>(small_back.mapped());
    EXPECT_EQ(std::vector<std::uint32_t>(mapped, mapped + 4), texels);
    const auto scaled = large_back.download<std::uint32_t>(16);
    for (std::size_t i = 0; i < 16; ++i)
        EXPECT_EQ(scaled[i], texels[i / 8 * 2 + i % 4 / 2]) << "texel " << i;
    commands.begin();
    commands.clear(small, {0, 1, 0, 1});
    commands.copy(small, small_back);
    commands.submit_and_wait();
    EXPECT_EQ(mapped[3], 0xFF00FF00U);
}

TEST(Commands, a_buffer_smaller_than_the_image_is_an_error) {
    Device device;
    const Buffer buffer(device, "short", 12);
    DeviceImage image(device, "image", 2, 2, VK_FORMAT_B8G8R8A8_UNORM);
    Commands commands(device);
    commands.begin();
    EXPECT_THROW(commands.copy(buffer, image), Error);
    EXPECT_THROW(commands.copy(image, buffer), Error);
}

TEST(Commands, calls_out_of_order_and_out_of_bounds_are_errors_and_work_goes_on) {
    Device device;
    Buffer words(device, "words", 16);
    const Buffer few(device, "few", 8);
    Commands commands(device);
    EXPECT_THROW(commands.pass("too early"), Error);
    DeviceImage image(device, "image", 2, 2, VK_FORMAT_B8G8R8A8_UNORM);
    DeviceImage other(device, "other", 2, 2, VK_FORMAT_B8G8R8A8_UNORM);
    EXPECT_THROW(commands.copy(words, image), Error);
    EXPECT_THROW(commands.copy(image, words), Error);
    EXPECT_THROW(commands.copy(image, other, VK_FILTER_NEAREST), Error);
    EXPECT_THROW(commands.clear(image, {0, 0, 0, 0}), Error);
    EXPECT_THROW(commands.submit(), Error);
    EXPECT_THROW(commands.fill(words, 1), Error);
    commands.begin();
    EXPECT_THROW(commands.fill({words, 8, 12}, 1), Error);
    EXPECT_THROW(commands.fill({words, 2, 4}, 1), Error);
    EXPECT_THROW(commands.copy(few, words, 12), Error);
    EXPECT_THROW(commands.copy({words, 8}, few, ~std::uint64_t{0}), Error);
    EXPECT_THROW(static_cast<void>(commands.pass_times()), Error);
    commands.pass("fill");
    commands.fill(words, 7);
    EXPECT_EQ(commands.recorded().back().barriers, 0U) << "of what was refused";
    commands.submit();
    EXPECT_THROW(commands.begin(), Error);
    EXPECT_THROW(static_cast<void>(commands.pass_times()), Error);
    commands.wait();
    EXPECT_EQ(words.download<std::uint32_t>(4), std::vector<std::uint32_t>(4, 7));
    EXPECT_THROW(words.download<std::uint32_t>(5), Error);
    EXPECT_THROW(words.upload(std::vector<std::uint32_t>(5)), Error);
}

}  // namespace
}  // namespace darb
