// SPDX-License-Identifier: MIT
// The table of training options: every row takes its values and no others, and is in the settings
// that a resumed run must repeat. That each does something: option_effect_test.
#include "trainer/options/option_table.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "engine/core/error.h"
#include "trainer/options/strategy.h"

namespace darb::test {
namespace {

using Json = nlohmann::json;

/// A value that is not the default, and within the limits.
std::string other_value(const OptionRow& row) {
    if (std::holds_alternative<bool TrainOptions::*>(row.member)) {
        const TrainOptions defaults;
        return defaults.*std::get<bool TrainOptions::*>(row.member) ? "off" : "on";
    }
    if (row.is_size) return "1.5GB";
    const bool counts = std::holds_alternative<int TrainOptions::*>(row.member) || row.least >= 1;
    return row.most == 1 ? "0.25" : row.most == 3 ? "2" : counts ? "8" : "0.75";
}

bool is_whole(const OptionRow& row) {
    return std::holds_alternative<std::optional<int> TrainOptions::*>(row.member) ||
           std::holds_alternative<std::uint64_t TrainOptions::*>(row.member);
}

std::string message_of(const char* flag, const std::string& value) {
    TrainOptions options;
    try {
        set_option(option_row(flag), value, options);
    } catch (const Error& e) {
        return e.what();
    }
    return "";
}

TEST(OptionTable, each_flag_that_changes_a_result_changes_its_setting_alone) {
    for (const OptionRow& row : option_rows()) {
        if (*row.flags == '\0' || *row.setting == '\0') continue;
        const std::string name = option_name(row);
        TrainOptions options;
        if (std::string(row.strategies) == "mcmc") options.strategy = Strategy::mcmc;
        if (std::string(row.strategies) == "budget") options.strategy = Strategy::budget;
        if (name == "--shape-lr") options.kernel = KERNEL_BETA;
        if (name == "--kernel-lr") options.learn_kernel = 3;
        if (name.starts_with("--camera-")) options.refine_cameras = true;
        if (name == "--depth-weight") options.depth = true;
        options.surface = name == "--surface-from" || name == "--distortion-weight" ||
                          name == "--flatness-weight";
        const Json before = settings_json(options);
        set_option(row, is_whole(row) ? "8" : other_value(row), options);
        const Json after = settings_json(options);
        const Json::json_pointer place(row.setting);
        ASSERT_TRUE(after.contains(place)) << name;
        EXPECT_TRUE(!before.contains(place) || before[place] != after[place]) << name;
    }
}

TEST(OptionTable, settings_come_back_from_their_text) {
    for (const OptionRow& row : option_rows()) {
        if (*row.flags == '\0' || *row.setting == '\0') continue;
        TrainOptions options;
        set_option(row, is_whole(row) ? "8" : other_value(row), options);
        const Json settings = settings_json(options);
        EXPECT_EQ(Json::parse(settings.dump()), settings) << option_name(row);
        // What stands in the text is what the flag takes, but where it settles to something else.
        const Json::json_pointer place(row.setting);
        if (row.resolved || !settings.contains(place) || row.is_switch) continue;
        TrainOptions again;
        const Json& value = settings[place];
        set_option(row, value.is_boolean() ? (value.get<bool>() ? "on" : "off") : value.dump(),
                   again);
        EXPECT_EQ(settings_json(again), settings) << option_name(row);
    }
}

TEST(OptionTable, flags_and_settings_are_each_of_one_row) {
    std::set<std::string> flags, settings;
    for (const OptionRow& row : option_rows()) {
        if (*row.setting != '\0') {
            EXPECT_TRUE(settings.insert(row.setting).second) << row.setting;
        }
        if (*row.flags == '\0') continue;
        EXPECT_TRUE(flags.insert(option_name(row)).second) << row.flags;
        EXPECT_NE(std::string(row.help), "") << row.flags;
        EXPECT_NE(default_text(row), "") << row.flags;
    }
}

TEST(OptionTable, refusals_name_option_value_reason_and_remedy) {
    EXPECT_EQ(message_of("--iterations", "0"),
              "--iterations 0: must be a whole number from 1 to 10000000\n"
              "  It takes a whole number from 1 to 10000000; default: 30000.");
    for (const auto& [flag, value, reason] :
         {std::tuple{"--seed", "-1", "must be a whole number of at least 0"},
          {"--random-points", "0", "must be a whole number from 1"},
          {"--random-points", "5000000000", "to 4294967295"},
          {"--max-memory", "-1", "of at least 1"},
          {"--max-memory", "1.5XB", "has no unit of bytes"},
          {"--max-memory", "much", "is no number"},
          {"--max-memory", "nan", "is no finite number"},
          {"--lambda-dssim", "inf", "is no finite number"},
          {"--lambda-dssim", "1.01", "must be a number from 0 to 1"},
          {"--iterations", "1.5", "is no whole number"},
          {"--iterations", "12x", "is no number"},
          {"--position-lr-init", "0", "above 0"},
          {"--densify-until-iter", "-1", "from 0"},
          {"--resolution-ramp", "maybe", "is neither on nor off"},
          {"--opacity-reg", "1e39", "is too large"}})
        EXPECT_NE(message_of(flag, value).find(reason), std::string::npos)
            << flag << " " << value << ": " << message_of(flag, value);
}

TEST(OptionTable, sizes_have_units_and_fractions) {
    for (const auto& [text, bytes] : {std::pair<const char*, std::uint64_t>{"800MB", 800'000'000},
                                      {"1.5GB", 1'500'000'000},
                                      {"1.5 gb", 1'500'000'000},
                                      {"2GiB", 2'147'483'648},
                                      {"64k", 64'000},
                                      {"123", 123}}) {
        TrainOptions options;
        set_option(option_row("--max-memory"), text, options);
        EXPECT_EQ(options.max_memory_bytes, bytes) << text;
    }
}

TEST(OptionTable, whole_numbers_keep_all_their_digits) {
    TrainOptions options;
    set_option(option_row("--seed"), "18446744073709551615", options);
    EXPECT_EQ(options.seed, 18446744073709551615ull);
    set_option(option_row("--seed"), "9007199254740993", options);
    EXPECT_EQ(options.seed, 9007199254740993ull);
    set_option(option_row("--iterations"), "2e3", options);
    EXPECT_EQ(options.iterations, 2'000);
}

TEST(Preset, of_3dgs_changes_what_its_rows_say) {
    TrainOptions options;
    use_3dgs_schedule(options);
    EXPECT_EQ(options.position_lr_init, 1.6e-4f);
    EXPECT_EQ(options.opacity_lr, 0.025f);
    EXPECT_EQ(options.prune_opacity, 0.005f);
    EXPECT_EQ(options.largest_scale, 0.0f);
    EXPECT_FALSE(options.random_background);
    EXPECT_FALSE(options.speed_up_short_runs);
    EXPECT_TRUE(options.late_resets);
    EXPECT_EQ(options.average_from, 1);
}

}  // namespace
}  // namespace darb::test
