// SPDX-License-Identifier: MIT
// One table makes every option: each row is set from the command line, by its name and from a saved
// request, and comes to the same value. Python's keywords: tests/python/trainer_test.py.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "tools/darb/train_flags.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class OptionNames : public testing::Test {
  protected:
    void SetUp() override {
        fs::create_directories(folder_ / "depths");
        fs::create_directories(folder_ / "run");
        write_file_atomic(folder_ / "kernel.json",
                          R"({"name": "own_of_names", "support": 9, "expression": "(1 - q/9)^3"})");
    }
    void TearDown() override { fs::remove_all(folder_); }

    /// A value that is not the default, and that the row takes.
    std::string other_value(const RequestOption& option) const {
        const std::map<std::string, std::string> own{
            {"--preset", "preview"},
            {"--source-path", (folder_ / "photos").string()},
            {"--output", (folder_ / "other").string()},
            {"--images", "images_4"},
            {"--hold-out", "every:5,arc:8"},
            {"--device", "llvm"},
            {"--kernel", "beta"},
            {"--kernel-file", (folder_ / "kernel.json").string()},
            {"--strategy", "mcmc"},
            {"--effects", "-sh"},
            {"--accuracy", "fast"},
            {"--pulses", "2"},
            {"--depths", (folder_ / "depths").string()},
            {"--depth-order", "centre16"},
            {"--render-scale", "1"},  // training takes no other
            {"--blocks", "3x2"},
            {"--tune", "scan=thread"},
            {"--points", (folder_ / "scan.las").string()},
            {"--roi", "sphere:1,2,3,4"},
            {"--clean-haze", "0.1,5"},
            {"--clean-free-space", "3"},
            {"--start-checkpoint", (folder_ / "begin.darb").string()}};
        const std::string name = option_name(option.row);
        if (const auto found = own.find(name); found != own.end()) return found->second;
        if (option.section == std::string("accuracy"))
            for (const AccuracySetting& setting : accuracy_settings())
                if (setting.name == option.key) return std::string(setting.choices[1].name);
        const std::string words = option.words;
        if (!words.empty()) return words.substr(words.rfind(',') + 1);
        const OptionRow& row = option.row;
        switch (option_kind(option)) {
            case OptionKind::on_off: {
                TrainRequest usual;
                set_request_option(usual, name, "on");
                return request_text(usual) == request_text({}) && name != "--resume" ? "off" : "on";
            }
            case OptionKind::size:
                return "1.5GB";
            case OptionKind::real:
                return "0.75";
            case OptionKind::text:
                ADD_FAILURE() << name << " has no value here";
                return "";
            case OptionKind::whole:
                break;
        }
        return row.most <= 3 ? "2" : "8";
    }
    /// What else the row needs.
    static GivenOptions beside(const RequestOption& option) {
        const std::string strategies = option.row.strategies, name = option_name(option.row);
        if (strategies == "mcmc") return {{"--strategy", "mcmc"}};
        if (name == "--pulses") return {{"--kernel", "raised_cosine"}};
        return {};
    }
    TrainRequest with(GivenOptions given) const {
        if (std::none_of(given.begin(), given.end(),
                         [](const auto& one) { return one.first == "--source-path"; }))
            given.emplace_back("--source-path", folder_.string());
        TrainRequest request;
        set_request_options(request, given);
        complete_request(request);
        return request;
    }

    const fs::path folder_ =
        fs::path(testing::TempDir()) / ("darb_names_" + std::to_string(::getpid()));
};

TEST_F(OptionNames, a_row_is_the_same_from_the_command_line_by_name_and_from_a_saved_request) {
    for (const RequestOption& option : request_options()) {
        if (*option.row.flags == '\0') continue;
        const std::string name = option_name(option.row), value = other_value(option);
        SCOPED_TRACE(name + " " + value);
        GivenOptions given = beside(option);
        const std::string usual = request_text(with(given));
        given.emplace_back(name, value);
        TrainRequest asked = with(given);
        EXPECT_TRUE(was_given(asked, name));
        const std::string text = request_text(asked);
        if (name != "--resume" && name != "--output" && name != "--render-scale") {
            EXPECT_NE(text, usual);
        }

        if (name != "--blocks" && name != "--tune") {  // not for the runs of a comparison
            std::vector<std::string> words{"--source-path=" + folder_.string()};
            if (name == "--source-path") words.clear();
            for (const auto& [one, its] : given)
                words.push_back(option.row.is_switch && one == name
                                    ? (its == "on" ? one : "--no-" + one.substr(2))
                                    : one + "=" + its);
            if (name == "--random-background") words.back() = "--fixed-background";
            EXPECT_EQ(request_text(parse_train_words(words, "", "test")), text);
        }

        asked.output = folder_ / "run";
        const std::string kept = request_text(asked);
        write_file_atomic(asked.output / kRequestFile, kept);
        const TrainRequest read = read_request(asked.output);
        EXPECT_EQ(request_text(read), kept);
        if (!option.key.empty()) {
            EXPECT_EQ(saved_value(option, read), saved_value(option, asked));
        }
    }
}

TEST_F(OptionNames, are_taken_with_dashes_or_underscores_and_turned_round) {
    for (const char* name : {"sh-degree", "sh_degree", "--sh-degree", "--sh_degree"}) {
        TrainRequest r;
        set_request_option(r, name, "1");
        EXPECT_EQ(r.train.sh_degree, 1) << name;
    }
    TrainRequest r;
    set_request_option(r, "r", "4");
    EXPECT_EQ(r.data.resolution, 4);
    set_request_option(r, "fixed_background", "on");
    EXPECT_FALSE(r.train.random_background);
    set_request_option(r, "no-report", "off");
    EXPECT_TRUE(r.report);
    set_request_option(r, "test_iterations", "5, 6");
    EXPECT_EQ(r.test_iterations, (std::vector<int>{5, 6}));
}

TEST_F(OptionNames, count_in_the_order_of_the_table) {
    TrainRequest r;
    set_request_options(r, {{"random_background", "on"},
                            {"effects", "-exposure"},
                            {"iterations", "70"},
                            {"kernel", "own_of_names"},
                            {"kernel_file", (folder_ / "kernel.json").string()},
                            {"preset", "preview"},
                            {"schedule", "3dgs"}});
    EXPECT_TRUE(r.train.random_background) << "beside the schedule";
    EXPECT_EQ(r.train.average_from, 1) << "the schedule's";
    EXPECT_EQ(r.train.iterations, 70);
    EXPECT_EQ(r.data.resolution, 400) << "the preset's";
    EXPECT_TRUE(r.effects.ends_with(",-exposure")) << r.effects;
    EXPECT_EQ(kernel_name(r.train.kernel), std::string("own_of_names"));
}

TEST_F(OptionNames, refusals_name_option_value_reason_and_remedy) {
    const auto refused = [](const char* name, const std::string& value, const std::string& reason) {
        TrainRequest r;
        try {
            set_request_option(r, name, value);
            ADD_FAILURE() << name << " " << value << " is taken";
        } catch (const Error& e) {
            const std::string text = e.what();
            EXPECT_NE(text.find(reason), std::string::npos) << text;
            EXPECT_EQ(text.rfind("-", 0), 0U) << text;
            EXPECT_NE(e.hint, "") << text;
        }
    };
    refused("no_such", "1", "--no-such: is no option of training");
    refused("", "1", "is no option of training");
    refused("iterations", "", "--iterations: has an empty value");
    refused("iterations", "0", "--iterations 0: must be a whole number from 1");
    refused("frames", "2", "from 3 to 2000");
    refused("frames", "many", "is no number");
    refused("depth_scale", "0", "--depth-scale 0: must be a number from");
    refused("resolution", "1e12", "must be");
    refused("eval", "maybe", "is neither on nor off");
    refused("lens", "round", "is none of auto, undistort and original");
    refused("start", "here", "is none of auto, points, dense, random");
    refused("preset", "huge", "no such preset");
    refused("schedule", "2dgs", "no such schedule");
    refused("strategy", "none", "no such strategy");
    refused("kernel", "foo", "no such kernel");
    refused("pulses", "2", "there is no such kernel");
    refused("accuracy", "best", "no such preset");
    refused("render_scale", "1/2", "for pictures only");
    refused("save_iterations", "-5", "--save-iterations -5: must be");
}

TEST_F(OptionNames, that_a_strategy_does_not_know_are_refused_beside_it) {
    EXPECT_NO_THROW(with({{"strategy", "mcmc"}, {"noise_lr", "3"}}));
    EXPECT_THROW(with({{"noise_lr", "3"}}), Error);
    EXPECT_THROW(with({{"strategy", "mcmc"}, {"percent_dense", "0.02"}}), Error);
}

TEST_F(OptionNames, what_is_asked_for_in_vain_is_noted) {
    const auto notes = [&](GivenOptions given) {
        std::string all;
        for (const std::string& note : unused_options(with(std::move(given)))) all += note + "\n";
        return all;
    };
    EXPECT_EQ(notes({}), "");
    EXPECT_NE(notes({{"shape_lr", "0.1"}}).find("--shape-lr is not used"), std::string::npos);
    EXPECT_EQ(notes({{"shape_lr", "0.1"}, {"kernel", "beta"}}), "");
    EXPECT_NE(notes({{"kernel_lr", "0.1"}}).find("--kernel-lr is not used"), std::string::npos);
    EXPECT_EQ(notes({{"kernel_lr", "0.1"}, {"learn_kernel", "9"}}), "");
    EXPECT_NE(notes({{"evaluation", "builtin"}, {"learn_kernel", "9"}}).find("polynomials only"),
              std::string::npos);
    EXPECT_NE(notes({{"iterations", "7"}, {"save_iterations", "9"}})
                  .find("--save-iterations 9 is beyond the end at 7"),
              std::string::npos);
}

}  // namespace
}  // namespace darb::test
