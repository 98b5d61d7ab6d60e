// SPDX-License-Identifier: MIT
// TrainerState: all that training changes, on the host: what a checkpoint holds, and what a probe
// forks and comes back to.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "engine/kernels/learned_profile.h"
#include "engine/scene/splat_model.h"
#include "shaders/shared/profile_args.h"
#include "shaders/shared/render_args.h"

namespace darb {

/// Counts over the whole run.
struct TrainCounters {
    std::uint64_t redone_iterations = 0, overflows = 0;  // an overflow redoes one or two iterations
    std::uint32_t longest_list = 0;        // intersections of one tile, most in any frame
    std::uint32_t huge_splats = 0;         // most in any frame
    std::uint32_t most_intersections = 0;  // between splats and tiles, most in any frame
    std::uint64_t bad_gradients = 0;
    std::uint64_t cloned_or_split = 0, pruned = 0;  // where splats move: new, moved
    std::uint32_t undrawn = 0;  // those of `pruned` that went after growth, as nothing drew them
    std::array<std::uint64_t, CULL_REASONS> culled{};  // summed over frames, by reason
};

/// Floats of TrainerState::profile where a kernel is learned.
constexpr std::size_t kProfileFloats = ProfileOptimizer::kStateFloats + PROFILE_SUMS;

/// moments: [attribute][2 N stride].
struct TrainerState {
    int iteration = 0;
    int next_probe = 0;
    std::vector<float> smoothing;  // [N], or empty where the effect is off
    std::vector<float> exposure;   // Exposure::state(), or empty
    std::vector<float> cameras;    // CameraRefinement::state(), or empty
    std::vector<float> profile;    // ProfileOptimizer::state() and sums of ProfileSums, or empty
    SplatModel model;
    std::vector<std::vector<float>> moments;
    std::vector<float> rest_sum;           // [N][stride of kShRest]; empty where there is none
    std::vector<float> gradient_sum;       // [N][2]
    std::vector<std::vector<float>> mean;  // IterateAverage::state()
    std::uint32_t averaged = 0;            // its count
    TrainCounters counters;
};

/// Throws Error where the lengths of the arrays do not fit together.
void check_state(const TrainerState& state);

/// Another degree of colour: parameters and moments of new bands are 0, the mean begins anew.
void set_degree(TrainerState& state, int degree);

}  // namespace darb
