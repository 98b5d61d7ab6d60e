// SPDX-License-Identifier: MIT
// Settings that a run may change while it trains, as a window that follows it asks for. What
// buffers and passes are made for stays: kernel, effects, strategy, colour degree, start.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "trainer/options/options.h"

namespace darb {

/// What is absent stays.
struct RunChange {
    std::optional<int> iterations = {};                  // of the whole run
    std::optional<std::uint32_t> max_splats = {};        // 1 and more
    std::optional<std::uint64_t> max_memory_bytes = {};  // device memory; 0: as much as there is

    bool operator==(const RunChange&) const = default;
};

/// Where a run is when it is asked to change.
struct ChangePlace {
    int iteration = 0;             // the last that is done
    bool averages = false;         // the mean of the last iterations has begun
    bool ended_early = false;      // the run ends itself
    bool several = false;          // ranks train together
    std::uint64_t peak_bytes = 0;  // of device memory so far
};

/// Why the change cannot be made, a sentence; empty where it can.
std::string change_refusal(const RunChange& change, const TrainOptions& options,
                           const ChangePlace& place);
/// Puts the change into the options.
void apply_change(const RunChange& change, TrainOptions& options);
/// What differs, as "iterations 3000 instead of 1000"; empty where nothing does.
std::string change_text(const TrainOptions& before, const TrainOptions& after);

/// What a live view answers to a step: how long it held the run up on purpose, s, and what the run
/// is to do before the next one, in this order.
struct LiveAnswer {
    LiveAnswer(double paused = 0) : paused_s(paused) {}

    double paused_s;
    std::vector<RunChange> changes;
    bool measures = false;  // PSNR of the held-out photos
    bool saves = false;     // checkpoint and scene
    bool stops = false;     // as Ctrl-C does
    bool again = false;     // the view is to be shown what came of it before the next step
};

}  // namespace darb
