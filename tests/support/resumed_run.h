// SPDX-License-Identifier: MIT
// Trainers that run to an iteration, and runs that stop there and resume from a file.
#pragma once

#include <filesystem>

#include "tests/support/tiny_training.h"
#include "trainer/step/checkpoint.h"

namespace darb::test {

inline void run_to(Trainer& trainer, int iteration) {
    while (trainer.iteration() < iteration) trainer.step();
}

inline void run_and_drain(Trainer& trainer, int iteration) {
    run_to(trainer, iteration);
    trainer.drain();
}

/// Compares `whole`, as far as it has run, with runs that stop earlier and resume from a file.
inline void expect_resumes(const TinyTraining& t, Trainer& whole, const std::vector<int>& stops) {
    for (const int stop : stops) {
        SCOPED_TRACE(fmt::format("stopped at {}", stop));
        const auto path = std::filesystem::path(testing::TempDir()) /
                          fmt::format("darb_resume_{}_{}", ::getpid(), stop);
        {
            Trainer first = t.trainer();
            run_to(first, stop);
            write_checkpoint(path, {first.state(), settings_text(t.options),
                                    dataset_fingerprint(t.dataset, t.photos), 1.0});
        }
        const Checkpoint checkpoint = read_checkpoint(path);
        check_resumable(checkpoint, path, t.options, t.dataset,
                        dataset_fingerprint(t.dataset, t.photos));
        Trainer second = t.trainer();
        second.restore(checkpoint.state);
        EXPECT_EQ(second.iteration(), stop);
        run_to(second, whole.iteration());
        EXPECT_TRUE(same_state(whole, second));
        EXPECT_EQ(second.counters().cloned_or_split, whole.counters().cloned_or_split);
        EXPECT_EQ(second.counters().pruned, whole.counters().pruned);
        EXPECT_EQ(second.counters().culled, whole.counters().culled);
        std::filesystem::remove(path);
    }
}

}  // namespace darb::test
