// SPDX-License-Identifier: MIT
// engine/plan/tuning_names, tuner: names, what a device allows, the record on disk,
// what wins.
#include "engine/plan/tuner.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/rng.h"
#include "engine/primitives/radix_sort.h"
#include "tests/support/scoped_variants.h"
#include "tests/support/shared_device.h"
#include "tests/support/test_device_options.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;

DeviceInfo some_gpu() {
    DeviceInfo info;
    info.name = "Some GPU";
    info.driver = "some driver 1.2";
    info.driver_version = 12;
    info.cache_uuid = "00ff";
    info.type = "discrete";
    info.max_storage_buffer_bytes = 0xFFFFFFFF;
    info.max_workgroup_threads = 1024;
    info.shared_memory_bytes = 48 * 1024;
    info.subgroup_size = info.min_subgroup_size = info.max_subgroup_size = 32;
    return info;
}

std::vector<std::string> choices(const DeviceInfo& info, const std::string& group) {
    for (const TuningGroup& g : tuning_groups(info))
        if (g.name == group) return g.choices;
    return {};
}

std::string refusal(const std::string& text) {
    try {
        parse_tuning(some_gpu(), text, "--tune");
    } catch (const Error& e) {
        return e.what();
    }
    return "";
}

/// A cache folder of its own, gone afterwards.
class Tuner : public testing::Test {
  protected:
    void SetUp() override { fs::create_directories(folder_); }
    void TearDown() override { fs::remove_all(folder_); }
    static TuningRecord record() {
        return {parse_tuning(some_gpu(), "backward=buckets,blend=256x1,scan=thread", "test"),
                {{"blend", "128x2", 1.5}, {"blend", "256x1", 1.25}}};
    }
    fs::path only_file() const {
        fs::path file;
        for (const auto& entry : fs::directory_iterator(folder_)) {
            EXPECT_TRUE(file.empty()) << "two files";
            file = entry.path();
        }
        return file;
    }
    const fs::path folder_ =
        fs::path(testing::TempDir()) / fmt::format("darb_tuning_{}", ::getpid());
};

TEST(Tuning, names_come_back_in_one_order) {
    const TuningNames names =
        parse_tuning(some_gpu(), "backward=buckets,scatter=columns", "--tune");
    EXPECT_EQ(names_text(names), "scatter=columns,backward=buckets");
    EXPECT_EQ(parse_tuning(some_gpu(), "", "--tune"), TuningNames{});
}

TEST(Tuning, unknown_names_are_errors_that_list_the_known_ones) {
    for (const char* text :
         {"no_such=1", "blend=1x256", "backward", "backward=", "=", "backward=buckets,,"}) {
        SCOPED_TRACE(text);
        EXPECT_NE(refusal(text).find("backward=team|subgroup|buckets"), std::string::npos)
            << refusal(text);
    }
    EXPECT_NE(refusal("no_such=1").find("'no_such'"), std::string::npos);
    EXPECT_NE(refusal("blend=1x256").find("'1x256'"), std::string::npos);
}

TEST(Tuning, lanes_are_a_choice_where_the_device_has_several_sizes) {
    using Names = std::vector<std::string>;
    DeviceInfo info = some_gpu();
    EXPECT_EQ(choices(info, "lanes"), Names{}) << "one size";
    EXPECT_EQ(tuning_names(usual_tuning(info)).count("lanes"), 0U);
    EXPECT_NE(refusal("lanes=16").find("'lanes' names no choice"), std::string::npos);
    EXPECT_TRUE(checkpoint_tuning(info, "lanes=16,backward=buckets", "file").contains("backward"));
    EXPECT_FALSE(checkpoint_tuning(info, "lanes=16", "file").contains("lanes"));
    info.min_subgroup_size = 8;  // as an Arc
    EXPECT_EQ(choices(info, "lanes"), (Names{"32", "8", "16"}));
    info.shared_memory_bytes = 16 * 1024;  // a kilobyte a subgroup, 32 of them a tile
    EXPECT_EQ(choices(info, "lanes"), (Names{"32", "16"}));
    const TuningNames names = checkpoint_tuning(info, "lanes=16", "file");
    EXPECT_EQ(with_names(usual_tuning(info), names).blend_lanes, 16U);
    EXPECT_EQ(tuning_names(with_names(usual_tuning(info), names)).at("lanes"), "16");
    EXPECT_FALSE(checkpoint_tuning(info, "lanes=8", "file").contains("lanes"));
    info = some_gpu();
    info.subgroup_size = info.max_subgroup_size = 64;  // as an RX 7900
    EXPECT_EQ(choices(info, "lanes"), (Names{"64", "32"}));
    info.subgroup_size = info.min_subgroup_size = info.max_subgroup_size = 128;
    EXPECT_EQ(choices(info, "lanes"), Names{}) << "but 64 of them";
}

TEST(Tuning, shapes_are_those_that_fit_the_device) {
    using Names = std::vector<std::string>;
    DeviceInfo info = some_gpu();
    EXPECT_EQ(choices(info, "blend"), (Names{"128x2", "256x1", "64x4", "32x8", "records"}));
    info.subgroup_size = 64;
    EXPECT_EQ(choices(info, "blend"), (Names{"256x1", "128x2", "64x4", "records"}));
    info.subgroup_size = 4;  // a subgroup's list takes a kilobyte
    info.shared_memory_bytes = 32 * 1024;
    EXPECT_EQ(choices(info, "blend"), (Names{"16x16", "128x2", "64x4", "32x8", "records"}));
    EXPECT_EQ(choices(info, "scatter").front(), "ballot");
    info.driver = "llvmpipe Mesa 25";
    EXPECT_EQ(choices(info, "scatter").front(), "columns");
    EXPECT_TRUE(is_known_device(info));
}

TEST(Tuning, sums_by_pixels_need_subgroups_of_32_lanes_or_fewer_and_shared_memory) {
    using Names = std::vector<std::string>;
    DeviceInfo info = some_gpu();
    const Names all{"team", "subgroup", "buckets", "pixels", "pixels4"};
    EXPECT_EQ(choices(info, "backward"), all);
    EXPECT_EQ(lanes_by_pixels(info, 32), 32U);
    info.subgroup_size = info.max_subgroup_size = 64;  // as an RX 7900, which has both
    EXPECT_EQ(choices(info, "backward"), all);
    EXPECT_EQ(lanes_by_pixels(info, 64), 32U);
    info.min_subgroup_size = 64;  // as Vega
    EXPECT_EQ(choices(info, "backward"), (Names{"team", "subgroup", "buckets"}));
    info = some_gpu();
    info.shared_memory_bytes = 16 * 1024;
    EXPECT_EQ(choices(info, "backward"), (Names{"team", "subgroup", "buckets"}));
    EXPECT_THROW(parse_tuning(info, "backward=pixels", "--tune"), Error);
}

TEST(Tuning, a_run_that_blends_by_records_says_so_and_keeps_it) {
    Device& device = shared_device();
    EXPECT_EQ(result_tuning(device).find("blend"), std::string::npos);
    std::string text;
    {
        const ScopedVariants some(device, "blend=records");
        EXPECT_EQ(tuning_names(device.tuning()).at("blend"), "records");
        text = result_tuning(device);
    }
    EXPECT_NE(text.find("blend=records"), std::string::npos) << text;
    EXPECT_TRUE(resumed_tuning(device.info(), device.tuning(), text, "file").blend_records);
    Tuning records = device.tuning();
    records.blend_records = true;
    EXPECT_FALSE(resumed_tuning(device.info(), records, "backward=subgroup", "file").blend_records);
}

TEST(Tuning, a_run_that_sums_by_chunks_says_so_and_keeps_it) {
    Device& device = shared_device();
    EXPECT_EQ(result_tuning(device).find("sums"), std::string::npos);
    const ScopedVariants some(device, "sums=chunks,depths=three,emit=slots,tiles=longest");
    EXPECT_TRUE(device.tuning().short_depths && device.tuning().emit_by_slots &&
                device.tuning().longest_first);
    const std::string text = result_tuning(device);
    EXPECT_NE(text.find("sums=chunks"), std::string::npos) << text;
    EXPECT_EQ(text.find("emit"), std::string::npos) << text;
    EXPECT_TRUE(resumed_tuning(device.info(), device.tuning(), text, "file").sums_by_chunks);
    EXPECT_FALSE(
        resumed_tuning(device.info(), device.tuning(), "backward=subgroup", "file").sums_by_chunks);
}

TEST(Tuning, a_device_runs_its_defaults_until_it_is_told_otherwise) {
    Device& device = shared_device();
    EXPECT_EQ(device.tuning(), usual_tuning(device.info()));
    const ScopedVariants some(device, "scatter=ballot,backward=buckets");
    EXPECT_EQ(device.tuning().scatter, SortScatter::ballot);
    EXPECT_EQ(device.tuning().backward, BackwardBlend::buckets);
    EXPECT_EQ(result_tuning(device), "backward=buckets");
    const ScopedVariants other(device, "exp=builtin");
    EXPECT_EQ(result_tuning(device), "backward=buckets,exp=builtin");
    EXPECT_EQ(RadixSort(device, 100).scatter(), SortScatter::ballot);
}

TEST(FormTimes, another_form_is_best_only_for_a_gain_beyond_the_spread) {
    const auto best = [](std::vector<std::vector<double>> rounds_ms, std::vector<bool> may = {}) {
        return best_form({std::move(rounds_ms)}, may);
    };
    const std::vector<double> usual{1, 1, 1, 1, 1};
    EXPECT_EQ(best({usual, {0.98, 0.98, 0.98, 0.98, 0.98}}), 0U) << "2 % are not worth a change";
    EXPECT_EQ(best({usual, {0.9, 0.9, 0.9, 0.9, 0.9}}), 1U);
    EXPECT_EQ(best({usual, {0.9, 0.6, 1.4, 0.7, 1.3}}), 0U) << "a spread of a third";
    EXPECT_EQ(best({usual, {0.9, 0.9, 0.9, 0.9, 9}}), 1U) << "one that was disturbed";
    EXPECT_EQ(best({usual, {0.9, 0.9, 0.9, 0.9, 0.9}, {0.8, 0.8, 0.8, 0.8, 0.8}}), 2U);
    EXPECT_EQ(
        best({usual, {0.1, 0.1, 0.1, 0.1, 0.1}, {0.9, 0.9, 0.9, 0.9, 0.9}}, {true, false, true}),
        2U);
    EXPECT_EQ(best({{5, 4, 3, 2, 1}, {4.5, 3.6, 2.7, 1.8, 0.9}}), 1U) << "while a clock rises";
    EXPECT_EQ(best({{0, 0, 0}, {0, 0, 0}}), 0U) << "no clock";
    EXPECT_FALSE(may_be_chosen("buckets"));
    EXPECT_TRUE(may_be_chosen("subgroup"));
}

/// A GPU with made-up times and clock, so that no test waits.
class FakeGpu {
  public:
    explicit FakeGpu(std::vector<double> ms_at_boost) : ms_(std::move(ms_at_boost)) {}
    double noise = 0;             // standard deviation, a share of a time
    double slows_down_after = 0;  // seconds of work; 0: never

    /// The pass takes a fifth of a frame.
    double sample_ms(std::size_t form) {
        const double ms =
            ms_[form] * 1980 / clock_mhz() * std::max(0.2, 1 + noise * random_.normal());
        now_s_ += 5 * ms / 1000;
        busy_s_ += 5 * ms / 1000;
        return ms;
    }
    void idle(double seconds) {  // a pipeline compiles
        now_s_ += seconds;
        busy_s_ = 0;
    }
    TimedForms forms() {
        return {[this](std::size_t form) { return sample_ms(form); }, [this] { return now_s_; }};
    }
    FormChoice choose() {
        idle(2);
        return choose_form(forms(), ms_.size(), {0.6, 4, 9, 25, 1});
    }
    double now_s() const { return now_s_; }

  private:
    // 345 MHz where it idles, 1,980 after half a second of work; a hot one loses a third.
    double clock_mhz() const {
        const double risen = 345 + (1980 - 345) * std::min(1.0, busy_s_ / 0.5);
        if (slows_down_after == 0 || busy_s_ < slows_down_after) return risen;
        return risen * std::max(0.66, 1 - 0.3 * (busy_s_ - slows_down_after));
    }
    std::vector<double> ms_;
    double now_s_ = 0, busy_s_ = 0;
    Pcg32 random_{3, 3};
};

// The earlier method: three frames to warm up, the least of seven, one form after the other.
std::size_t best_one_after_the_other(FakeGpu& gpu, std::size_t count) {
    gpu.idle(2);
    std::vector<double> least(count, 1e9);
    for (std::size_t form = 0; form < count; ++form)
        for (int i = 0; i < 10; ++i) {
            const double ms = gpu.sample_ms(form);
            if (i >= 3) least[form] = std::min(least[form], ms);
        }
    return static_cast<std::size_t>(std::min_element(least.begin(), least.end()) - least.begin());
}

TEST(FormTimes, a_gpu_whose_clock_rises_ends_with_the_right_form) {
    FakeGpu cold({0.43, 0.55});  // as team and subgroup
    EXPECT_EQ(best_one_after_the_other(cold, 2), 1U) << "the fake does not mislead";
    FakeGpu gpu({0.43, 0.55});
    const FormChoice usual = gpu.choose();
    EXPECT_EQ(usual.form, 0U);
    EXPECT_NEAR(usual.ms[0], 0.43, 0.01) << "not of the boost clock";
    EXPECT_NEAR(usual.ms[1], 0.55, 0.01);
    EXPECT_LT(gpu.now_s(), 2 + 4 + 2) << "not bounded";
    EXPECT_EQ(FakeGpu({0.84, 0.21}).choose().form, 1U);  // as strips and tiles
    EXPECT_EQ(FakeGpu({0.30, 0.34, 0.25, 0.27}).choose().form, 2U);
}

TEST(FormTimes, noise_changes_no_form_and_hides_no_gain) {
    int changed = 0, found = 0;
    for (int i = 0; i < 40; ++i) {
        FakeGpu equal({0.5, 0.5, 0.5, 0.5}), better({0.5, 0.4});
        equal.idle(0.01 * i);
        for (FakeGpu* gpu : {&equal, &better}) {
            gpu->noise = 0.1;
            for (int skipped = 0; skipped < i; ++skipped) gpu->sample_ms(0);  // other numbers
        }
        changed += equal.choose().form != 0 ? 1 : 0;
        found += better.choose().form == 1 ? 1 : 0;
    }
    EXPECT_LE(changed, 1) << "of 40";
    EXPECT_GE(found, 39) << "of 40";
    EXPECT_EQ(FakeGpu({0.5, 0.5, 0.5}).choose().form, 0U) << "equal without noise";
}

TEST(FormTimes, a_gpu_that_becomes_hot_ends_with_the_right_form) {
    for (const double after : {0.3, 0.7, 1.0, 1.5}) {
        FakeGpu same({0.5, 0.5}), better({0.5, 0.45}), worse({0.5, 0.55});
        for (FakeGpu* gpu : {&same, &better, &worse}) gpu->slows_down_after = after;
        EXPECT_EQ(same.choose().form, 0U) << after;
        EXPECT_EQ(better.choose().form, 1U) << after;
        EXPECT_EQ(worse.choose().form, 0U) << after;
    }
}

TEST(FormTimes, rounds_and_warm_up_are_bounded) {
    int taken = 0;
    double now = 0;
    const TimedForms slow{[&](std::size_t) {
                              ++taken;
                              now += 3;
                              return 3000.0;
                          },
                          [&] { return now; }};
    const std::array<std::size_t, 2> both{0, 1};
    EXPECT_EQ(time_rounds(slow, both, {0, 0, 2, 9, 2}).rounds_ms[1].size(), 2U);
    EXPECT_EQ(taken, 4);
    EXPECT_TRUE(warm_up(slow, {0, 0, 2, 9, 2}));
    EXPECT_EQ(taken, 4) << "no warm-up was asked for";
    double ms = 1;
    now = 0;
    const TimedForms unsteady{[&](std::size_t) {
                                  ms *= 1.02;
                                  now += 0.05;
                                  return ms;
                              },
                              [&] { return now; }};
    EXPECT_FALSE(warm_up(unsteady, {0.6, 4, 2, 9, 2}));
    EXPECT_LT(now, 4.3);
}

TEST(Tuning, who_goes_on_with_a_run_that_knew_no_choice_of_exp_takes_polynomials) {
    Tuning tuning = usual_tuning(some_gpu());
    EXPECT_FALSE(tuning.exp_builtin);
    tuning.exp_builtin = true;
    EXPECT_FALSE(resumed_tuning(some_gpu(), tuning, "backward=team", "file").exp_builtin);
    EXPECT_TRUE(resumed_tuning(some_gpu(), tuning, "exp=builtin", "file").exp_builtin);
}

TEST(Tuning, the_drivers_exp_is_a_choice_only_where_it_is_accurate) {
    Device& device = shared_device();
    const double error = exp_error(device);
    EXPECT_GT(error, 1e-8) << "float32 rounds";
    EXPECT_LT(error, 1e-3);
    const TuningRecord refused = measure_tuning(device, "exp", 0.5 * error);
    EXPECT_EQ(refused.choice.at("exp"), "polynomial");
    EXPECT_EQ(refused.times.size(), 1U);
    EXPECT_EQ(measure_tuning(device, "exp", error).times.size(), 2U);
}

TEST_F(Tuner, a_record_is_read_back) {
    write_tuning(some_gpu(), folder_, record());
    const auto read = read_tuning(some_gpu(), folder_);
    ASSERT_TRUE(read);
    EXPECT_EQ(read->choice, record().choice);
    ASSERT_EQ(read->times.size(), 2U);
    EXPECT_EQ(read->times[1].choice, "256x1");
    EXPECT_EQ(read->times[1].ms, 1.25);
}

TEST_F(Tuner, a_record_says_whether_a_run_has_looked_at_it) {
    TuningRecord seen = record();
    write_tuning(some_gpu(), folder_, seen);
    EXPECT_FALSE(read_tuning(some_gpu(), folder_)->seen_in_a_run);
    seen.seen_in_a_run = true;
    write_tuning(some_gpu(), folder_, seen);
    EXPECT_TRUE(read_tuning(some_gpu(), folder_)->seen_in_a_run);
}

TEST_F(Tuner, a_record_of_another_device_is_none) {
    write_tuning(some_gpu(), folder_, record());
    const std::string text = read_text_file(only_file());
    const auto refused = [&](auto change) {
        DeviceInfo info = some_gpu();
        change(info);
        if (read_tuning(info, folder_)) return false;
        // Nor where the file has the name that this device's would have.
        const fs::path file = only_file();
        write_tuning(info, folder_, record());
        for (const auto& entry : fs::directory_iterator(folder_))
            write_file_atomic(entry.path(), text);
        const bool none = !read_tuning(info, folder_);
        for (const auto& entry : fs::directory_iterator(folder_))
            if (entry.path() != file) fs::remove(entry.path());
        return none;
    };
    EXPECT_TRUE(refused([](DeviceInfo& info) { info.name = "Another"; }));
    EXPECT_TRUE(refused([](DeviceInfo& info) { info.driver = "another"; }));
    EXPECT_TRUE(refused([](DeviceInfo& info) { info.driver_version += 1; }));
    EXPECT_TRUE(refused([](DeviceInfo& info) { info.cache_uuid = "00fe"; }));
    EXPECT_TRUE(refused([](DeviceInfo& info) { info.subgroup_size = 64; }));
    EXPECT_TRUE(read_tuning(some_gpu(), folder_));
}

TEST_F(Tuner, a_record_that_was_cut_or_changed_is_none) {
    write_tuning(some_gpu(), folder_, record());
    const fs::path file = only_file();
    const std::string text = read_text_file(file);
    for (std::size_t size = 0; size + 2 < text.size(); size += 7) {
        write_file_atomic(file, std::string_view(text).substr(0, size));
        EXPECT_FALSE(read_tuning(some_gpu(), folder_)) << size << " bytes";
    }
    const auto changed = [&](const std::string& from, const std::string& to) {
        std::string other = text;
        const std::size_t at = other.find(from);
        EXPECT_NE(at, std::string::npos) << from;
        write_file_atomic(file, other.replace(at, from.size(), to));
        return !read_tuning(some_gpu(), folder_);
    };
    EXPECT_TRUE(changed("\"format\": 6", "\"format\": 5")) << "measured while the GPU idled";
    EXPECT_TRUE(changed("blend=256x1", "blend=255x1"));
    EXPECT_TRUE(changed("\"shaders\": \"", "\"shaders\": \"0"));
    EXPECT_TRUE(changed("\"times\": [", "\"times\": [7,"));
    EXPECT_TRUE(changed("1.25", "null"));
}

TEST_F(Tuner, a_folder_that_cannot_be_written_is_no_error) {
    write_file_atomic(folder_ / "file", std::string_view("x"));
    write_tuning(some_gpu(), folder_ / "file", record());  // below a file: not even for root
    EXPECT_FALSE(read_tuning(some_gpu(), folder_ / "file"));
    write_tuning(some_gpu(), {}, record());
    EXPECT_FALSE(read_tuning(some_gpu(), {}));
}

TEST_F(Tuner, a_known_device_is_not_measured_unless_asked) {
    DeviceOptions options = test::device_options();
    options.cache_folder = folder_;
    Device device(options);
    if (!is_known_device(device.info())) GTEST_SKIP() << "a device that is always measured";
    std::string said;
    tune(device, {"", "", false, [&](const std::string& line) { said += line; }});
    EXPECT_EQ(said, "");
    EXPECT_EQ(device.tuning(), usual_tuning(device.info()));
    EXPECT_TRUE(fs::is_empty(folder_));
}

// What is forced takes precedence over the environment, that over the record, and that over the
// default.
TEST_F(Tuner, the_nearest_word_wins) {
    DeviceOptions options = test::device_options();
    options.cache_folder = folder_;
    Device device(options);
    TuningRecord record{tuning_names(usual_tuning(device.info())), {}};
    record.choice["scan"] = choices(device.info(), "scan")[1];
    record.choice["scatter"] = "ballot";
    record.choice["backward"] = "buckets";
    write_tuning(device.info(), folder_, record);
    tune(device, {"backward=subgroup", "scatter=columns,backward=buckets", false, {}});
    EXPECT_EQ(tuning_names(device.tuning()).at("scan"), record.choice["scan"]);
    EXPECT_EQ(device.tuning().scatter, SortScatter::columns);
    EXPECT_EQ(device.tuning().backward, BackwardBlend::subgroup);
    EXPECT_THROW(tune(device, {"", "no_such=1", false, {}}), Error);
}

// It does not matter which way is the fastest, only that all were measured and one of each is kept.
TEST_F(Tuner, retuning_measures_every_way_and_keeps_the_choice_slow) {
    DeviceOptions options = test::device_options();
    options.cache_folder = folder_;
    Device device(options);
    std::string said;
    tune(device, {"", "", true, [&](const std::string& line) { said += line + "\n"; }});
    EXPECT_NE(said.find("measuring"), std::string::npos);
    const auto record = read_tuning(device.info(), folder_);
    ASSERT_TRUE(record);
    TuningNames measured = tuning_names(device.tuning());
    EXPECT_EQ(measured.at("photos"), "auto");
    measured.erase("photos");
    EXPECT_EQ(record->choice, measured);
    std::size_t all = 0;
    for (const TuningGroup& group : tuning_groups(device.info())) {
        if (group.passes.empty()) continue;  // is never measured
        for (const std::string& way : group.choices) {
            if (way == "builtin" && exp_error(device) > kExpTolerance) continue;
            ++all;
            const auto time = std::find_if(
                record->times.begin(), record->times.end(),
                [&](const auto& t) { return t.group == group.name && t.choice == way; });
            ASSERT_NE(time, record->times.end()) << group.name << "=" << way;
            EXPECT_GT(time->ms, 0) << group.name << "=" << way;
        }
    }
    EXPECT_EQ(record->times.size(), all);
    Device next(options);
    tune(next, {});
    EXPECT_EQ(next.tuning(), device.tuning());
}

}  // namespace
}  // namespace darb::test
