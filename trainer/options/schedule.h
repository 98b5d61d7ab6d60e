// SPDX-License-Identifier: MIT
// Schedule: what a training run does at which iteration. A run resolves it once from its
// TrainOptions, which it keeps: what is absent there takes its default by the length of the run,
// the kernel and the strategy. From then on it only answers. It knows no scene: lengths are in
// scene extents, photos come as arguments.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "trainer/options/strategy.h"

namespace darb {

/// Some iterations that begin a run and see smaller photos.
struct RampStep {
    int divisor;     // divides the photos' sides
    int iterations;  // how many see photos of this size
};

class Schedule {
  public:
    /// Implicit, because a schedule is what options mean. Throws Error where they contradict
    /// themselves.
    Schedule(const TrainOptions& of = {});

    /// Learning rates of Adam. position is in scene extents.
    struct Rates {
        double position = 0;
        float scale = 0, rotation = 0, opacity = 0;
        float shape = 0;               // for a kernel with shapes
        float sh_dc = 0, sh_rest = 0;  // sh_rest: for a step by the mean of rest_every iterations
    };
    Rates rates(int iteration) const;
    double position_rate(int iteration) const;
    double exposure_rate(int iteration) const;

    /// The degree of view-dependent colour where no probe decides on it.
    int sh_degree(int iteration) const;

    /// Whether density control has a round after this iteration.
    bool refines_after(int iteration) const;
    /// Whether opacities are reset after this iteration: every so many up to resets.last, and, as
    /// 3DGS does, where growth begins over a white background.
    bool resets_after(int iteration) const;
    /// Whether a round after this iteration prunes by size: as 3DGS does after its first opacity
    /// reset, where there is a size to prune by.
    bool prunes_by_size(int iteration) const;
    /// Whether the regularisers act at this iteration on what its frame does not show too. A splat
    /// that few photos show is worth less than one that many show: in sets of up to 50 photos at
    /// each, in larger ones at 50 in a round of the photos, so that what ten of a thousand show
    /// stays; at each where the strategy wants it.
    bool regularises_unseen(std::size_t photos, int iteration) const;

    /// Whether the run ends with the mean of its last splats, and whether that takes in what this
    /// iteration leaves.
    bool averages() const { return average_begin < last; }
    bool averages_after(int iteration) const;
    /// The run is to end sooner than its options say, with a mean that begins after this iteration
    /// and takes as large a share of the run as it would have; at once where it ends without.
    /// Nothing where its mean has begun. Rates stay as the whole run has them.
    void end_early(int iteration);

    /// Whether the profile of the kernel changes after this iteration: options.learn_kernel times,
    /// evenly, until the mean of the last splats begins.
    bool changes_kernel_after(int iteration) const;
    /// Whether the gradient of the profile is taken at an iteration, from 1: every eighth, or the
    /// first of each batch that has one of these, as it moves slowly.
    bool samples_kernel_at(int iteration) const;

    /// Whether splats go after this iteration that nothing draws any more: every so many iterations
    /// from the end of growth until the mean begins, which takes in the same splats throughout.
    bool drops_undrawn_after(int iteration) const;
    /// The last iteration with a round of density control or such a drop after it, or less.
    int last_change() const;

    /// Whether the terms count at this iteration that lay splats on surfaces.
    bool lays_on_surfaces(int iteration) const {
        return options.surface && iteration > options.surface_from * double(options.iterations);
    }

    /// The steps of the resolution ramp, smallest photos first: a quarter of the sides in the first
    /// tenth of the run, half up to 3/10 of it, the longest side never below 100 px; none where it
    /// is off. longest_side: of all photos, px.
    std::vector<RampStep> ramp_steps(int longest_side) const;
    /// What the sides of the photos are divided by in an iteration (from 1): 1 after the last step.
    int resolution_divisor(int iteration, int longest_side) const;

    /// A step ends with iterations in (step_begin(i), i], i being its last: one, or a batch.
    int step_begin(int iteration) const {
        return std::max(0, (iteration - 1) / options.batch * options.batch);
    }
    /// The last iteration of the step after this one: steps begin at multiples of the batch.
    int step_end(int iteration) const;

    TrainOptions options;  // as they were given
    int last = 0;          // the run ends with it: options.iterations, or sooner after end_early()
    // Where they are not given, the strategy's.
    float initial_opacity = 0, initial_scale = 0, prune_opacity = 0;
    /// The opacity below which a splat is drawn by nobody: neither in training nor where pictures
    /// are drawn by default.
    double undrawn_opacity = 0;
    int rest_every = 1;  // see TrainOptions::sh_rest_every
    /// How many times faster a run below kShortRun iterations learns shapes and opacities, grows,
    /// and comes to its degrees of colour: at most kMostSpeedup times.
    float speedup = 1;
    int degree_interval = 0;
    /// Density control: rounds every `interval` iterations after `begin` and before `end`.
    struct Rounds {
        int begin = 0, end = 0, interval = 1;
    } rounds;
    /// Opacity resets. last: the last iteration that ends with one; 0: none does.
    struct Resets {
        int interval = 1, last = 0;
        float to = 0;           // opacity
        bool at_begin = false;  // where growth begins, too
    } resets;
    Rates first;                    // at the start of the run
    float last_position_rate = 0;   // where it has fallen to its end
    double position_falls_for = 1;  // share of the run, then it stays
    double last_share = 1;          // what the other rates fall to over the second half
    int average_begin = 0;
    int kernel_end = 0;       // the profile of a learned kernel changes until then
    double length_scale = 1;  // multiplies every length that options have for a Gaussian
    float largest_scale = 0;  // a splat's limit, over scene_reach() and length_scale; 0: none
};

}  // namespace darb
