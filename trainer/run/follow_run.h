// SPDX-License-Identifier: MIT
// What the ranks of a training run share at its start and before each step, and the run of a rank
// that is not the first: it trains, and leaves files and words to that one.
#pragma once

#include <atomic>
#include <optional>
#include <string>
#include <vector>

#include "trainer/run/run.h"
#include "trainer/step/checkpoint.h"

namespace darb {

/// The checkpoint that a run goes on from; the file is the first rank's, the others have it from
/// there. Read before the trainer is made: what of the device's tuning changes bits is as the run
/// began with.
std::optional<Checkpoint> checkpoint_of(Device& device, const RunOptions& run);

/// What a Trainer is made with: the start, with the origin of the checkpoint that it will restore,
/// as photos are seen from there. given: what it starts from in place of initial_model().
SplatModel first_model(const Dataset& dataset, const Schedule& schedule,
                       const std::optional<Checkpoint>& checkpoint,
                       const SplatModel* given = nullptr);

/// Throws Error where ranks train other things, or on devices that may round differently.
void check_ranks(const Device& device, const Schedule& schedule, const RankGroup& ranks,
                 const std::string& fingerprint);

/// Before a step, on all ranks: whether any is to stop. Now and then also that they are equal.
bool is_to_stop(Trainer& trainer, const RankGroup& ranks, bool stop);

/// run_training() of another rank than the first.
TrainResult follow_training(Device& device, const Dataset& dataset, const Schedule& schedule,
                            const RunOptions& run, const std::atomic<bool>* stop,
                            std::vector<ImageU8> photos);

}  // namespace darb
