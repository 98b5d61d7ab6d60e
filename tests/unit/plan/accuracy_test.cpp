// SPDX-License-Identifier: MIT
// The table of accuracy settings: names, presets, and what the errors say.
#include "engine/plan/accuracy.h"

#include <gtest/gtest.h>

#include <set>

#include "engine/core/error.h"

namespace darb {
namespace {

TEST(Accuracy, names_are_unique_and_presets_in_range) {
    std::set<std::string_view> names;
    for (const AccuracySetting& s : accuracy_settings()) {
        EXPECT_TRUE(names.insert(s.name).second) << s.name;
        std::set<std::string_view> choices;
        for (const AccuracyChoice& c : s.choices) EXPECT_TRUE(choices.insert(c.name).second);
        for (const int preset : s.preset) {
            ASSERT_GE(preset, 0);
            ASSERT_LT(preset, static_cast<int>(s.choices.size()));
        }
        EXPECT_TRUE(s.choices[0].in_training) << "training falls back to it: " << s.name;
    }
}

TEST(Accuracy, balanced_is_the_default) {
    EXPECT_EQ(preset_accuracy(kBalanced), Accuracy{});
    ForwardOptions options;
    set_options(Accuracy{}, options);
    const ForwardOptions plain;
    EXPECT_EQ(options.alpha_cutoff, plain.alpha_cutoff);
    EXPECT_EQ(options.transmittance_stop, plain.transmittance_stop);
    EXPECT_EQ(options.polynomial_degree, plain.polynomial_degree);
    EXPECT_EQ(options.evaluation, kEvaluationOfDevice);
    EXPECT_EQ(options.storage, plain.storage);
    EXPECT_EQ(options.depth_order, plain.depth_order);
}

TEST(Accuracy, text_names_the_nearest_preset) {
    EXPECT_EQ(accuracy_text(Accuracy{}), "balanced");
    EXPECT_EQ(accuracy_text(preset_accuracy(kFast)), "fast");
    EXPECT_EQ(accuracy_text(preset_accuracy(kExact)), "exact");
    Accuracy a;
    a.choice[kStorage] = find_choice(kStorage, "float16");
    EXPECT_EQ(accuracy_text(a), "storage float16");
    a = preset_accuracy(kFast);
    a.choice[kDepthOrder] = 0;
    EXPECT_EQ(accuracy_text(a), "fast, depth_order centre");
}

std::string message(int setting, std::string_view name, bool training) {
    try {
        find_choice(setting, name, training);
    } catch (const Error& e) {
        return e.what();
    }
    return "no error";
}

TEST(Accuracy, wrong_names_and_choices_without_a_backward_pass_are_errors) {
    EXPECT_NE(message(kAlphaCutoff, "1/2", false).find("1/255, 1/1024, 1/64"), std::string::npos);
    EXPECT_NE(message(kDepthOrder, "pixel", true).find("no backward pass"), std::string::npos);
    EXPECT_NE(message(kRenderScale, "1/2", true).find("-r 2"), std::string::npos);
    EXPECT_EQ(message(kDepthOrder, "pixel", false), "no error");
    EXPECT_EQ(message(kDepthOrder, "centre16", true), "no error");
}

TEST(Accuracy, a_frame_takes_from_the_model_what_is_left_to_the_file) {
    SplatModel model;
    model.sh_degree = 1;
    model.footprint = Footprint::exact;
    EXPECT_EQ(frame_accuracy({}, model).footprint, Footprint::exact);
    EXPECT_EQ(frame_accuracy({}, model).sh_degree, 1);
    Accuracy a;
    a.choice[kFootprint] = find_choice(kFootprint, "psi");
    a.choice[kShDegree] = find_choice(kShDegree, "2");
    EXPECT_EQ(frame_accuracy(a, model).footprint, Footprint::psi);
    EXPECT_EQ(frame_accuracy(a, model).sh_degree, 1) << "a model has no more than it has";
}

}  // namespace
}  // namespace darb
