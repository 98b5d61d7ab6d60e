// SPDX-License-Identifier: MIT
// How much memory is free, according to made-up Linux files: on a machine, and in control groups of
// both versions, as in a container.
#include "engine/core/memory.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <limits>
#include <string>

namespace darb {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMiB = 1 << 20;
constexpr std::uint64_t kNone = std::numeric_limits<std::uint64_t>::max();

class FreeMemory : public testing::Test {
  protected:
    void SetUp() override {
        root_ = fs::temp_directory_path() /
                ("darb_memory_" + std::to_string(::getpid()) + "_" +
                 ::testing::UnitTest::GetInstance()->current_test_info()->name());
        fs::remove_all(root_);
    }
    void TearDown() override { fs::remove_all(root_); }

    void put(const std::string& path, const std::string& text) const {
        fs::create_directories((root_ / path).parent_path());
        std::ofstream(root_ / path) << text << "\n";
    }
    void machine_has(std::uint64_t available_mib) const {
        put("proc/meminfo",
            "MemTotal:       99999999 kB\nMemAvailable:   " + std::to_string(available_mib * 1024) +
                " kB\nSwapFree:       1024 kB\nHugePages_Total:       0");
    }
    static std::string bytes(std::uint64_t mib) { return std::to_string(mib * kMiB); }
    std::uint64_t free_mib() const { return free_memory(root_) / kMiB; }

    fs::path root_;
};

TEST_F(FreeMemory, nothing_says_anything_without_the_files) {
    EXPECT_EQ(free_memory(root_), kNone);
    put("sys/fs/cgroup/memory.max", "max");
    put("sys/fs/cgroup/memory.current", "123");
    EXPECT_EQ(free_memory(root_), kNone);
}

TEST_F(FreeMemory, of_a_machine_is_what_is_available_and_swap) {
    machine_has(500);
    EXPECT_EQ(free_mib(), 501U);
}

TEST_F(FreeMemory, files_that_a_container_keeps_count_as_free) {
    machine_has(100'000);
    put("proc/self/cgroup", "0::/");
    put("sys/fs/cgroup/memory.max", bytes(1000));
    put("sys/fs/cgroup/memory.current", bytes(990));
    put("sys/fs/cgroup/memory.stat", "anon " + bytes(90) + "\nfile " + bytes(850) + "\nshmem " +
                                         bytes(50) + "\ninactive_file " + bytes(500) +
                                         "\nactive_file " + bytes(300) + "\nslab_reclaimable " +
                                         bytes(40) + "\nslab_unreclaimable " + bytes(7));
    EXPECT_EQ(free_mib(), 1000U - (990 - 840));
}

TEST_F(FreeMemory, the_tightest_of_nested_groups_decides) {
    machine_has(100'000);
    put("proc/self/cgroup", "0::/user/run.scope");
    put("sys/fs/cgroup/user/memory.max", bytes(800));
    put("sys/fs/cgroup/user/memory.current", bytes(300));
    put("sys/fs/cgroup/user/run.scope/memory.max", "max");
    put("sys/fs/cgroup/user/run.scope/memory.current", bytes(200));
    EXPECT_EQ(free_mib(), 500U);
    put("sys/fs/cgroup/user/run.scope/memory.max", bytes(600));
    EXPECT_EQ(free_mib(), 400U);
    put("sys/fs/cgroup/user/run.scope/memory.stat", "inactive_file " + bytes(150));
    EXPECT_EQ(free_mib(), 500U);
    machine_has(20);
    EXPECT_EQ(free_mib(), 21U);
    put("sys/fs/cgroup/user/memory.current", bytes(801));  // for a moment it may be over
    EXPECT_EQ(free_mib(), 0U);
}

TEST_F(FreeMemory, version_1_of_control_groups_has_other_names) {
    machine_has(100'000);
    put("proc/self/cgroup", "12:cpu,cpuacct:/box\n4:hugetlb,memory:/box/1\n0::/");
    put("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712");
    put("sys/fs/cgroup/memory/memory.usage_in_bytes", bytes(5000));
    put("sys/fs/cgroup/memory/box/1/memory.limit_in_bytes", bytes(1000));
    put("sys/fs/cgroup/memory/box/1/memory.usage_in_bytes", bytes(900));
    put("sys/fs/cgroup/memory/box/1/memory.stat",
        "cache " + bytes(700) + "\ninactive_file " + bytes(1) + "\ntotal_inactive_file " +
            bytes(400) + "\ntotal_active_file " + bytes(200) + "\nhierarchical_memory_limit " +
            bytes(1000));
    EXPECT_EQ(free_mib(), 700U);
    put("sys/fs/cgroup/memory/box/memory.limit_in_bytes", bytes(1200));
    put("sys/fs/cgroup/memory/box/memory.usage_in_bytes", bytes(1150));
    EXPECT_EQ(free_mib(), 50U);
}

// Its files are at the top, but its name is the one outside.
TEST_F(FreeMemory, a_container_of_version_1_finds_its_own_group_at_the_top) {
    machine_has(100'000);
    put("proc/self/cgroup", "4:memory:/docker/0123abcd");
    put("sys/fs/cgroup/memory/memory.limit_in_bytes", bytes(2000));
    put("sys/fs/cgroup/memory/memory.usage_in_bytes", bytes(700));
    EXPECT_EQ(free_mib(), 1300U);
    put("sys/fs/cgroup/memory/memory.stat", "hierarchical_memory_limit " + bytes(1500));
    EXPECT_EQ(free_mib(), 800U);
}

TEST_F(FreeMemory, damaged_files_say_nothing) {
    machine_has(300);
    put("proc/self/cgroup", "memory\n::\n4:memory");
    put("sys/fs/cgroup/memory.max", "");
    put("sys/fs/cgroup/memory.current", "x");
    put("sys/fs/cgroup/memory.stat", "inactive_file many");
    EXPECT_EQ(free_mib(), 301U);
}

TEST(FreeMemoryHere, is_some) {
    EXPECT_GT(free_memory(), 0U);
}

}  // namespace
}  // namespace darb
