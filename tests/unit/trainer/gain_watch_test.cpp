// SPDX-License-Identifier: MIT
// When a run ends itself because held-out photos no longer gain.
#include "trainer/step/held_out_gain.h"

#include <gtest/gtest.h>

#include "engine/core/error.h"

namespace darb::test {
namespace {

TrainOptions patient(int iterations) {
    TrainOptions options;
    options.iterations = 10'000;
    options.end_without_gain = iterations;
    return options;
}

GainWatch watch_of(const TrainOptions& options) {
    return GainWatch(Schedule(options));
}

TEST(GainWatch, looks_four_times_in_its_patience_between_growth_and_the_mean) {
    const GainWatch watch = watch_of(patient(2'000));
    std::vector<int> looks;
    for (int i = 1; i <= 10'000; ++i)
        if (watch.is_due(i - 1, i)) looks.push_back(i);
    EXPECT_EQ(looks, (std::vector<int>{5'000, 5'500, 6'000, 6'500, 7'000, 7'500, 8'000}));
    EXPECT_TRUE(watch.is_due(5'498, 5'502)) << "after a batch";
    EXPECT_FALSE(watch.is_due(5'500, 5'504));
    const GainWatch off = watch_of(patient(0));
    for (int i = 1; i <= 10'000; ++i) EXPECT_FALSE(off.is_due(i - 1, i));
}

TEST(GainWatch, ends_a_run_after_so_many_iterations_without_a_gain) {
    GainWatch watch = watch_of(patient(1'000));
    EXPECT_FALSE(watch.add({5'000, 25.0}));
    EXPECT_FALSE(watch.add({5'250, 25.3}));
    EXPECT_FALSE(watch.add({5'500, 25.31})) << "0.01 dB are no gain";
    EXPECT_FALSE(watch.add({5'750, 25.1}));
    EXPECT_FALSE(watch.add({6'000, 25.32})) << "the patience begins anew";
    EXPECT_EQ(watch.best().iteration, 6'000);
    EXPECT_FALSE(watch.add({6'500, 25.2}));
    EXPECT_TRUE(watch.add({7'000, 25.12}));
    EXPECT_NEAR(watch.pace(), -0.2, 1e-9);
    EXPECT_NE(watch.reason().find("since iteration 6000, when they were at 25.32 dB"),
              std::string::npos)
        << watch.reason();
    EXPECT_NE(watch.reason().find("-0.200 dB"), std::string::npos) << watch.reason();
}

TEST(GainWatch, one_that_is_restored_goes_on_as_the_other) {
    GainWatch whole = watch_of(patient(1'000)), rest = whole;
    whole.add({5'000, 25.0});
    whole.add({5'250, 24.9});
    rest.restore(whole.state());
    EXPECT_EQ(rest.best().iteration, 5'000);
    for (const int i : {5'500, 5'750, 6'000})
        EXPECT_EQ(whole.add({i, 25.01}), rest.add({i, 25.01})) << i;
    EXPECT_EQ(whole.reason(), rest.reason());
    rest.set_end(7'000);
    EXPECT_FALSE(rest.is_due(6'249, 6'250)) << "its end is known";
}

TEST(GainWatch, wants_photos_that_are_held_out) {
    Dataset dataset;
    dataset.views.resize(2);
    EXPECT_NO_THROW(check_gain_watch(dataset, patient(0), {}));
    try {
        check_gain_watch(dataset, patient(500), {});
        FAIL() << "it was taken";
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find("--end-without-gain 500: no photo is held out"),
                  std::string::npos)
            << e.what();
        EXPECT_NE(std::string(e.what()).find("--eval"), std::string::npos);
    }
    dataset.views[1].is_test = true;
    EXPECT_NO_THROW(check_gain_watch(dataset, patient(500), {}));
}

}  // namespace
}  // namespace darb::test
