// SPDX-License-Identifier: MIT
// Frozen splats in a training run: whatever the strategy, they are drawn and keep every bit, and a
// run resumed from a checkpoint gives equal bits.
#include <algorithm>

#include "tests/support/resumed_run.h"
#include "tests/support/tiny_training.h"

namespace darb::test {
namespace {

constexpr std::uint32_t kFrozen = 64;

TinyTraining many_splats() {
    TinyTraining t = tiny_training({.splats = 150});
    t.options.max_splats = 400;
    return t;
}

Trainer frozen_trainer(const TinyTraining& t, std::uint32_t frozen) {
    return Trainer(shared_device(), t.dataset, t.photos, t.start(), t.options, {}, frozen);
}

// Compares the values of the first splats; harmonics are compared up to the width of the starting
// ones.
bool begins_alike(const SplatModel& a, const SplatModel& b, std::uint32_t splats) {
    for (int at = 0; at < kAttributeCount; ++at) {
        const std::vector<float>& one = attribute_values(a, at);
        const std::vector<float>& two = attribute_values(b, at);
        const std::size_t each = one.size() / a.size();
        if (each != two.size() / b.size() ||
            !std::equal(one.begin(), one.begin() + std::ptrdiff_t(each * splats), two.begin()))
            return false;
    }
    return true;
}

void expect_frozen(const TinyTraining& t) {
    Trainer whole = frozen_trainer(t, kFrozen), first = frozen_trainer(t, kFrozen),
            rest = frozen_trainer(t, kFrozen);
    for (Trainer* trainer : {&whole, &first}) run_and_drain(*trainer, trainer == &whole ? 35 : 25);
    const SplatModel start = t.start();
    const Trainer::State end = whole.state();
    EXPECT_TRUE(begins_alike(start, end.model, kFrozen));
    EXPECT_FALSE(begins_alike(start, end.model, kFrozen + 1)) << "the next one is trained";
    EXPECT_GT(whole.counters().cloned_or_split, 10U) << "density control must take part";
    EXPECT_GT(end.model.size(), kFrozen);
    for (const std::vector<float>& moments : end.moments) {
        const std::size_t held = moments.size() / end.model.size() * kFrozen;
        EXPECT_TRUE(std::all_of(moments.begin(), moments.begin() + std::ptrdiff_t(held),
                                [](float value) { return value == 0; }));
    }
    rest.restore(first.state());
    run_and_drain(rest, 35);
    EXPECT_TRUE(same_state(whole, rest));
}

TEST(FrozenSplats, keep_every_bit) {
    expect_frozen(many_splats());
}

TEST(FrozenSplats, keep_every_bit_with_a_batch_and_with_other_strategies_long) {
    TinyTraining t = many_splats();
    t.options.batch = 2;
    expect_frozen(t);
    t = many_splats();
    t.options.strategy = Strategy::mcmc;
    expect_frozen(t);
    t.options.strategy = Strategy::budget;
    t.options.prune_opacity = 0.05f;
    t.options.morton_order = true;
    expect_frozen(t);
}

// Where all splats are frozen, no iteration changes the scene, and it is drawn as at the start.
TEST(FrozenSplats, of_all_splats_leave_the_picture_as_it_was) {
    TinyTraining t = many_splats();
    t.options.max_splats = 2 * kFrozen;
    t.options.densify_until = 0;
    Trainer trainer = frozen_trainer(t, 2 * kFrozen);
    const ImageF before = trainer.render(t.dataset.views[0].camera);
    run_and_drain(trainer, 4);
    EXPECT_EQ(trainer.splat_count(), 2 * kFrozen);
    EXPECT_TRUE(begins_alike(t.start(), trainer.state().model, 2 * kFrozen));
    EXPECT_EQ(before.data, trainer.render(t.dataset.views[0].camera).data);
}

}  // namespace
}  // namespace darb::test
