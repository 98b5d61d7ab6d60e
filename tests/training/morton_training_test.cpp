// SPDX-License-Identifier: MIT
// Training with the splats in Morton order: it repeats, and a checkpoint goes on with the same
// bits.
#include <gtest/gtest.h>

#include "tests/support/resumed_run.h"
#include "tests/support/tiny_training.h"

namespace darb::test {
namespace {

bool same_bits(const SplatModel& a, const SplatModel& b) {
    for (int at = 0; at < kAttributeCount; ++at)
        if (attribute_values(a, at) != attribute_values(b, at)) return false;
    return true;
}

TEST(MortonTraining, repeats_resumes_and_is_another_order) {
    TinyTraining t = tiny_training();
    Trainer plain = t.trainer();
    t.options.morton_order = true;
    Trainer whole = t.trainer(), first = t.trainer(), rest = t.trainer();
    for (Trainer* trainer : {&plain, &whole}) run_and_drain(*trainer, 45);
    run_and_drain(first, 33);
    rest.restore(first.state());
    run_and_drain(rest, 45);
    EXPECT_GT(whole.counters().cloned_or_split, 10U);
    EXPECT_TRUE(same_bits(whole.model(), rest.model()));
    EXPECT_FALSE(same_bits(whole.model(), plain.model()));
    const double splats = plain.splat_count();
    EXPECT_NEAR(whole.splat_count(), splats, 0.2 * splats);
}

}  // namespace
}  // namespace darb::test
