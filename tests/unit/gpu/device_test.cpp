// SPDX-License-Identifier: MIT
// Device: listing, selection, buffers, budgets and injected faults.
#include "engine/gpu/device.h"
#include "engine/gpu/shader_table.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <thread>

#include "engine/core/error.h"
#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/device_state.h"
#include "engine/gpu/faults.h"
#include "engine/gpu/pipeline.h"
#include "tests/support/test_device_options.h"

namespace darb {
namespace {

DeviceInfo fake(int index, std::string name, bool usable) {
    DeviceInfo info;
    info.index = index;
    info.name = std::move(name);
    info.usable = usable;
    info.reason = usable ? "discrete device" : "rejected: Vulkan 1.1, needs 1.3";
    return info;
}

const std::vector<DeviceInfo> kFakes = {fake(0, "GeForce RTX 4090", true),
                                        fake(1, "llvmpipe (LLVM 15)", true),
                                        fake(2, "Old Radeon", false)};

std::string error_of(auto&& action) try {
    action();
    return "no error";
} catch (const Error& error) {
    return error.what();
}

struct Environment {
    explicit Environment(const char* fault) { ::setenv("DARB_FAULT", fault, 1); }
    ~Environment() { ::unsetenv("DARB_FAULT"); }
};

TEST(Device, an_extension_that_is_not_offered_is_an_error_with_both_names) {
    DeviceOptions options = test::device_options();
    options.device_extensions = {"VK_KHR_none"};
    const std::string text = error_of([&] { Device device(options); });
    EXPECT_NE(text.find(Device().info().name), std::string::npos) << text;
    EXPECT_NE(text.find("VK_KHR_none"), std::string::npos) << text;
    EXPECT_NE(text.find("--device"), std::string::npos) << text;
}

TEST(ChooseDevice, nothing_asked_takes_the_first) {
    EXPECT_EQ(choose_device(kFakes, ""), 0U);
}

TEST(ChooseDevice, part_of_name_matches_in_any_case) {
    EXPECT_EQ(choose_device(kFakes, "LLVMpipe"), 1U);
    EXPECT_EQ(choose_device(kFakes, "1"), 1U);
}

TEST(ChooseDevice, index_out_of_range_is_an_error_with_the_count) {
    EXPECT_NE(error_of([] { choose_device(kFakes, "7"); }).find("devices: 3, counted from 0"),
              std::string::npos);
}

TEST(ChooseDevice, unknown_name_is_an_error_with_all_names) {
    const std::string text = error_of([] { choose_device(kFakes, "Apple"); });
    EXPECT_NE(text.find("--device Apple"), std::string::npos) << text;
    EXPECT_NE(text.find("GeForce RTX 4090"), std::string::npos) << text;
}

TEST(ChooseDevice, unusable_device_is_an_error_with_its_reason) {
    const std::string text = error_of([] { choose_device(kFakes, "radeon"); });
    EXPECT_NE(text.find("needs 1.3"), std::string::npos) << text;
}

TEST(ChooseDevice, no_device_is_an_error_that_says_what_to_install) {
    const std::string text = error_of([] { choose_device({}, ""); });
    EXPECT_NE(text.find("mesa-vulkan-drivers"), std::string::npos) << text;
}

TEST(DescribeChoice, names_other_devices_and_what_to_know_of_the_driver) {
    DeviceInfo info = kFakes[0];
    info.driver = "NVIDIA 570.1";
    EXPECT_EQ(describe_choice(info, {}), "GeForce RTX 4090 (NVIDIA 570.1)");
    info.conformant = false;
    const std::string text = describe_choice(info, {"Intel UHD", "llvmpipe"});
    EXPECT_NE(text.find("--device also takes Intel UHD, llvmpipe"), std::string::npos) << text;
    EXPECT_NE(text.find("darb check"), std::string::npos) << text;
}

TEST(ListDevices, subgroups_that_the_blend_cannot_use_are_a_reason) {
    const auto trouble = [](std::uint32_t least, std::uint32_t most, bool required) {
        DeviceInfo info;
        info.min_subgroup_size = least;
        info.subgroup_size = info.max_subgroup_size = most;
        info.requires_subgroup_size = required;
        keep_subgroup_sizes(info);
        EXPECT_EQ(info.min_subgroup_size, required ? least : most);
        return subgroup_trouble(info);
    };
    for (const std::uint32_t size : {4u, 8u, 32u, 64u})
        EXPECT_EQ(trouble(size, size, false), "") << "the only size needs no asking";
    EXPECT_EQ(trouble(8, 32, true), "");
    EXPECT_EQ(trouble(1, 128, true), "");
    EXPECT_EQ(trouble(4, 32, false), "") << "MoltenVK on Apple's GPUs";
    EXPECT_EQ(trouble(8, 32, false), "") << "MoltenVK on Intel's";
    EXPECT_NE(trouble(1, 1, true).find("needs 4 to 64"), std::string::npos);
    EXPECT_NE(trouble(128, 128, true).find("needs 4 to 64"), std::string::npos);
}

TEST(ListDevices, too_few_storage_buffers_are_a_reason) {
    DeviceInfo info;
    const std::uint32_t rendering = storage_buffers(kRendering),
                        training = storage_buffers(kTraining);
    info.max_storage_buffers = rendering - 1;
    EXPECT_NE(buffers_trouble(info, kRendering).find(fmt::format("needs {}", rendering)),
              std::string::npos);
    info.max_storage_buffers = rendering;
    EXPECT_EQ(buffers_trouble(info, kRendering), "");
    EXPECT_NE(buffers_trouble(info, kTraining).find(fmt::format("needs {}", training)),
              std::string::npos);
    for (const ShaderBinary& shader : shader_table())
        EXPECT_LE(storage_buffers(shader.name), training) << shader.name;
    EXPECT_LE(training, kMostStorageBuffers) << "MoltenVK has no more places";
    for (const char* shader :
         {"compact", "emit", "emit_huge", "tile_ranges", "blend", "depth_light", "upsample",
          "scan_apply", "radix_scatter_ballot", "display"})
        EXPECT_LE(storage_buffers(shader), rendering) << shader;
}

TEST(ListDevices, every_usable_device_has_its_limits) {
    const std::vector<DeviceInfo> devices = list_devices();
    ASSERT_FALSE(devices.empty());
    for (const DeviceInfo& info : devices) {
        if (!info.usable) continue;
        EXPECT_GE(info.max_storage_buffer_bytes, 1U << 27) << info.name;
        EXPECT_GE(info.shared_memory_bytes, 16384U) << info.name;
        EXPECT_GE(info.subgroup_size, 4U) << info.name;
        EXPECT_GT(info.heap_bytes, 0U) << info.name;
    }
}

TEST(Buffer, upload_then_download_returns_the_bytes) {
    Device device{test::device_options()};
    for (const Memory memory : {Memory::device, Memory::host}) {
        Buffer buffer(device, "numbers", 4096 * 4, memory);
        std::vector<std::uint32_t> values(4096);
        for (std::uint32_t i = 0; i < values.size(); ++i) values[i] = i * 2654435761U;
        buffer.upload(values);
        EXPECT_EQ(buffer.download<std::uint32_t>(4096), values);
        EXPECT_EQ(buffer.download<std::uint32_t>(2, 40)[1], values[11]);
    }
}

TEST(Buffer, long_upload_crosses_the_staging_pieces) {
    Device device{test::device_options()};
    std::vector<std::uint32_t> values((40U << 20) / 4 + 3);
    for (std::uint32_t i = 0; i < values.size(); ++i) values[i] = i ^ 0xabcd;
    Buffer buffer(device, "long", values.size() * 4);
    buffer.upload(values);
    EXPECT_TRUE(buffer.download<std::uint32_t>(values.size()) == values);
}

TEST(Buffer, size_zero_is_legal) {
    Device device{test::device_options()};
    const Buffer buffer(device, "empty", 0);
    EXPECT_GT(buffer.bytes(), 0U);
}

TEST(Buffer, live_and_peak_bytes_are_counted) {
    Device device{test::device_options()};
    Buffer kept(device, "kept", 1000);
    {
        const Buffer other(device, "other", 2000);
        EXPECT_EQ(device.allocated_bytes(), 3000U);
    }
    Buffer moved = std::move(kept);
    EXPECT_EQ(device.allocated_bytes(), 1000U);
    EXPECT_EQ(device.peak_bytes(), 3000U);
}

TEST(Buffer, over_the_budget_is_an_error_with_name_and_size) {
    Device device{test::device_options()};
    device.set_memory_budget(3 << 20);
    const Buffer first(device, "first", 2 << 20);
    const std::string text = error_of([&] { Buffer(device, "splat means", 2 << 20); });
    EXPECT_NE(text.find("splat means"), std::string::npos) << text;
    EXPECT_NE(text.find("2.0 MiB"), std::string::npos) << text;
    EXPECT_EQ(device.allocated_bytes(), 2U << 20);
}

TEST(Buffer, larger_than_the_device_allows_is_an_error) {
    Device device{test::device_options()};
    const std::string text = error_of([&] { Buffer(device, "huge", std::uint64_t{1} << 60); });
    EXPECT_NE(text.find("\"huge\""), std::string::npos) << text;
}

// As many as photos of a long video: the drivers of AMD and others allow 4,096 allocations.
TEST(DeviceMemory, thousands_of_buffers_take_few_allocations_and_keep_apart) {
    const Environment environment("allocations:4");
    Device device{test::device_options()};
    std::vector<Buffer> buffers;
    std::uint32_t random = 1;
    const auto next = [&] { return random = random * 1664525U + 1013904223U; };
    const auto words_of = [](std::size_t i) { return 1 + i * 37 % 2000; };
    const auto fill = [&](std::size_t i) {
        buffers[i] = Buffer(device, "many", 4 * words_of(i));
        buffers[i].upload(std::vector<std::uint32_t>(words_of(i), static_cast<std::uint32_t>(i)));
    };
    buffers.resize(5000);
    for (std::size_t i = 0; i < buffers.size(); ++i) fill(i);
    for (int round = 0; round < 3000; ++round) {  // holes that others fill
        const std::size_t i = next() % buffers.size();
        buffers[i] = Buffer();
        if (round % 2 == 0) fill(i);
    }
    for (std::size_t i = 0; i < buffers.size(); ++i) {
        if (!buffers[i]) continue;
        ASSERT_EQ(buffers[i].download<std::uint32_t>(words_of(i)),
                  std::vector<std::uint32_t>(words_of(i), static_cast<std::uint32_t>(i)));
    }
    EXPECT_LE(device.state().device_memory->allocations(), 4U);
    buffers.clear();
    EXPECT_EQ(device.allocated_bytes(), 0U);
    EXPECT_LE(device.state().device_memory->allocations(), 2U) << "blocks go when they are empty";
}

TEST(DeviceMemory, large_buffers_have_allocations_of_their_own) {
    const Environment environment("allocations:3");
    Device device{test::device_options()};
    std::vector<Buffer> buffers;
    const std::string text = error_of([&] {
        for (int i = 0; i < 4; ++i) buffers.emplace_back(device, "large", 16 << 20);
    });
    EXPECT_EQ(buffers.size(), 3U);
    EXPECT_NE(text.find("\"large\""), std::string::npos) << text;
    EXPECT_NE(text.find("more buffers than the driver allows"), std::string::npos) << text;
    buffers.pop_back();
    buffers.emplace_back(device, "large", 16 << 20);  // room again
}

TEST(DeviceMemory, a_driver_without_memory_for_it_is_an_error) {
    Device device{test::device_options()};
    const VkMemoryRequirements needs{64, 16, 0};
    const std::string text = error_of(
        [&] { device.state().device_memory->take(needs, Memory::device, "buffer \"none\""); });
    EXPECT_NE(text.find("the driver has no memory for it"), std::string::npos) << text;
}

TEST(VulkanErrors, too_many_allocations_say_what_takes_them) {
    const std::string text =
        error_of([] { check_vulkan(VK_ERROR_TOO_MANY_OBJECTS, "buffer \"photo\""); });
    EXPECT_NE(text.find("photo"), std::string::npos) << text;
    EXPECT_NE(text.find("fewer photos"), std::string::npos) << text;
}

// What a fallback may catch, and what it may not.
TEST(VulkanErrors, have_a_kind_for_no_room_and_for_a_lost_device) {
    for (const VkResult full :
         {VK_ERROR_OUT_OF_DEVICE_MEMORY, VK_ERROR_OUT_OF_HOST_MEMORY, VK_ERROR_TOO_MANY_OBJECTS})
        EXPECT_THROW(check_vulkan(full, "it"), NoRoom) << full;
    EXPECT_THROW(check_vulkan(VK_ERROR_DEVICE_LOST, "it"), DeviceLost);
    try {
        check_vulkan(VK_ERROR_FEATURE_NOT_PRESENT, "it");
        ADD_FAILURE() << "no error";
    } catch (const NoRoom&) {
        ADD_FAILURE() << "no room";
    } catch (const DeviceLost&) {
        ADD_FAILURE() << "lost";
    } catch (const Error&) {
    }
}

TEST(VulkanErrors, of_buffers_and_submits_have_these_kinds) {
    DeviceOptions options = test::device_options();
    options.faults = parse_faults("oom:pairs,allocation:1048576,lost:1");
    Device device{options};
    EXPECT_THROW(Buffer(device, "pairs", 64), NoRoom);
    EXPECT_THROW(Buffer(device, "large", 2 << 20), NoRoom);
    device.set_memory_budget(1'000);
    EXPECT_THROW(Buffer(device, "small", 2'000), NoRoom);
    Buffer buffer(device, "buffer", 64);
    Commands commands(device);
    commands.begin();
    commands.pass("clear");
    commands.fill(buffer, 1);
    EXPECT_THROW(commands.submit_and_wait(), DeviceLost);
}

TEST(Faults, text_that_is_no_fault_is_an_error) {
    EXPECT_NE(error_of([] { parse_faults("oops"); }), "no error");
    EXPECT_NE(error_of([] { parse_faults("lost:0"); }), "no error");
    EXPECT_NE(error_of([] { parse_faults("lost:2x"); }), "no error");
    EXPECT_NE(error_of([] { parse_faults("binding:-1"); }), "no error");
    EXPECT_EQ(parse_faults("binding:4096").binding_bytes, 4096U);
    const Faults faults = parse_faults("oom:a,lost:3,oom:b");
    EXPECT_TRUE(faults.fails_allocation("b", 16));
    EXPECT_FALSE(faults.fails_allocation("c", 1 << 30));
    const Faults limits = parse_faults("allocation:64,memory:100");
    EXPECT_EQ(limits.allocation_bytes, 64U);
    EXPECT_FALSE(limits.fails_allocation("c", 100));
    EXPECT_TRUE(limits.fails_allocation("c", 101));
    EXPECT_EQ(parse_faults("timestamps:0").timestamp_bits, 0U);
    EXPECT_NE(error_of([] { parse_faults("timestamps:65"); }), "no error");
    const Faults molten = parse_faults("buffers:31,own_subgroups");
    EXPECT_EQ(molten.storage_buffers, 31U);
    EXPECT_TRUE(molten.own_subgroups);
    EXPECT_FALSE(limits.own_subgroups);
    EXPECT_TRUE(parse_faults("allocations:2").fails_allocations(3));
    EXPECT_FALSE(parse_faults("allocations:2").fails_allocations(2));
    EXPECT_FALSE(faults.fails_submit(2));
    EXPECT_TRUE(faults.fails_submit(3));
}

TEST(Faults, out_of_memory_names_the_buffer_and_frees_nothing_else) {
    const Environment environment("oom:pairs");
    Device device{test::device_options()};
    const Buffer fine(device, "others", 64);
    const std::string text = error_of([&] { Buffer(device, "pairs", 1 << 20); });
    EXPECT_NE(text.find("buffer \"pairs\" (1.0 MiB): out of device memory"), std::string::npos)
        << text;
    EXPECT_EQ(device.allocated_bytes(), 64U);
}

TEST(Faults, lost_device_names_the_passes) {
    const Environment environment("lost:2");
    Device device{test::device_options()};
    Buffer buffer(device, "buffer", 64);
    Commands commands(device);
    const auto run = [&] {
        commands.begin();
        commands.pass("clear");
        commands.fill(buffer, 1);
        commands.pass("clear again");
        commands.fill(buffer, 2);
        commands.submit_and_wait();
    };
    run();
    const std::string text = error_of(run);
    EXPECT_NE(text.find("passes \"clear\" to \"clear again\": the device was lost"),
              std::string::npos)
        << text;
}

// What goes there and back goes through a buffer of the host, which is no memory of the device.
TEST(Faults, memory_of_its_own_is_reached_by_copies) {
    const Environment environment("discrete");
    Device device{test::device_options()};
    EXPECT_FALSE(device.info().unified_memory);
    std::vector<std::uint32_t> values(10'000'000);  // more than one piece
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<std::uint32_t>(i * i);
    Buffer buffer(device, "buffer", values.size() * 4);
    buffer.upload(values);
    EXPECT_EQ(buffer.download<std::uint32_t>(values.size()), values);
    EXPECT_EQ(device.peak_bytes(), values.size() * 4);
}

// Staging copies share a pool of commands, and all threads one queue.
TEST(Faults, threads_copy_to_memory_of_its_own_at_the_same_time) {
    const Environment environment("discrete");
    Device device{test::device_options()};
    std::vector<std::thread> threads;
    std::atomic<int> wrong{0};
    for (std::uint32_t t = 0; t < 4; ++t)
        threads.emplace_back([&, t] {
            Buffer buffer(device, "buffer", 4096);
            for (std::uint32_t round = 0; round < 100; ++round) {
                const std::vector<std::uint32_t> values(1024, 1000 * t + round);
                buffer.upload(values);
                if (buffer.download<std::uint32_t>(1024) != values) ++wrong;
            }
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(wrong, 0);
}

// A module of the header and these capabilities.
std::vector<std::uint32_t> module_with(std::initializer_list<std::uint32_t> capabilities) {
    std::vector<std::uint32_t> words{0x07230203, 0x10500, 0, 1, 0};
    for (const std::uint32_t capability : capabilities)
        words.insert(words.end(), {2u << 16 | 17, capability});
    return words;
}

// Behind sType and pNext these structs hold VkBool32 alone.
template <class Struct>
int features_on(const Struct& features) {
    constexpr std::size_t kHeader = 2 * sizeof(void*);
    const auto* bytes = reinterpret_cast<const std::byte*>(&features);
    int count = 0;
    for (std::size_t at = kHeader; at + sizeof(VkBool32) <= sizeof(Struct);
         at += sizeof(VkBool32)) {
        VkBool32 on = VK_FALSE;
        std::memcpy(&on, bytes + at, sizeof on);
        count += on == VK_TRUE ? 1 : 0;
    }
    return count;
}

int all_features_on(const DeviceFeatures& f) {
    return features_on(f.core) + features_on(f.v11) + features_on(f.v12) + features_on(f.v13);
}

// scalarBlockLayout, synchronization2, subgroupSizeControl and computeFullSubgroups are those of
// the Vulkan calls; the shaders need no feature beyond them. One that begins to changes this test.
TEST(ShaderFeatures, a_device_is_asked_for_what_the_shaders_use_and_no_more) {
    DeviceFeatures wanted;
    want_features(needs_of_all_shaders(), wanted);
    EXPECT_EQ(all_features_on(wanted), 4);
    EXPECT_TRUE(wanted.v12.scalarBlockLayout && wanted.v13.synchronization2 &&
                wanted.v13.subgroupSizeControl && wanted.v13.computeFullSubgroups);
    std::vector<std::uint32_t> in_use;
    for (const ShaderNeed& need : needs_of_all_shaders()) in_use.push_back(need.capability);
    EXPECT_EQ(in_use, (std::vector<std::uint32_t>{1, 61, 62, 63, 64, 65}))
        << "compute shaders; subgroups with votes, arithmetic, ballots and shuffles";
    constexpr VkSubgroupFeatureFlags kAll = 0xff;
    EXPECT_EQ(missing_feature(needs_of_all_shaders(), wanted, kAll), "")
        << "int64, float64 and float atomics are not asked for";
}

// A device without it is asked for all the rest.
TEST(ShaderFeatures, half_precision_is_used_by_its_two_blends_alone) {
    std::vector<std::string> names;
    for (const ShaderBinary& shader : shader_table())
        for (const ShaderNeed& need : shader_needs({&shader, 1}))
            if (need.capability == 9) names.emplace_back(shader.name);
    EXPECT_EQ(names, (std::vector<std::string>{"blend_backward_half", "blend_half"}));
    EXPECT_TRUE(parse_faults("no_half").no_half);
}

TEST(ShaderFeatures, a_refusal_names_the_feature_and_who_needs_it) {
    const auto plain = module_with({1}), wide = module_with({1, 11, 4433}),
               votes = module_with({62});
    const std::vector<ShaderBinary> shaders{{"plain", plain}, {"wide", wide}, {"votes", votes}};
    const std::vector<ShaderNeed> needs = shader_needs(shaders);
    DeviceFeatures offered;
    constexpr VkSubgroupFeatureFlags kVotes = VK_SUBGROUP_FEATURE_VOTE_BIT;
    EXPECT_EQ(missing_feature(needs, offered, kVotes),
              "no scalarBlockLayout, which the arguments and buffers of all shaders need");
    want_features({}, offered);
    EXPECT_EQ(missing_feature(needs, offered, kVotes), "no shaderInt64, which shader wide needs");
    want_features(needs, offered);
    EXPECT_TRUE(offered.core.features.shaderInt64 && offered.v11.storageBuffer16BitAccess);
    EXPECT_EQ(all_features_on(offered), 6);
    EXPECT_EQ(missing_feature(needs, offered, kVotes), "");
    EXPECT_EQ(missing_feature(needs, offered, 0), "no subgroup votes, which shader votes needs");
}

TEST(ShaderFeaturesDeathTest, a_capability_without_a_row_aborts_with_the_shader) {
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    const auto module = module_with({1, 4242});
    const std::vector<ShaderBinary> shaders{{"new", module}};
    EXPECT_DEATH(shader_needs(shaders), "shader new asks for the capability 4242");
}

TEST(PipelineCache, broken_file_is_ignored) {
    const auto folder = std::filesystem::path(::testing::TempDir()) / "darb_cache_test";
    std::filesystem::remove_all(folder);
    DeviceOptions options = test::device_options();
    options.cache_folder = folder;
    { const Device device(options); }
    std::filesystem::create_directories(folder);
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        std::ofstream(entry.path()) << "nonsense";
    EXPECT_NO_THROW(Device{options});
    std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace darb
