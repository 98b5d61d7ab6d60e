// The step of a batch: the views one after the other into a tree of gradients, then one step of the
// optimizer of their mean. Of several ranks each does its aligned part of the views; their sums are
// added in the same tree, by all of them, and all make the step.
#pragma once

#include <vector>

#include "engine/ranks/ranks.h"
#include "trainer/gradient_tree.h"
#include "trainer/step.h"

namespace darb {

/// views: in the order of their places, which their inputs name; fewer than the batch at the end of
/// a run. One outcome a view, in order, the same on all ranks but for the times of passes.
std::vector<StepOutcome> run_batch_step(TrainingStep& step, GradientTree& tree,
                                        const GpuSplats& splats, std::vector<StepInput>& views,
                                        Ranks& ranks, int batch);

/// What one rank's gradients are for another: which rows any of its views showed, a bit a splat,
/// and these rows, of the degree of harmonics in use. The queue must be idle.
Bytes packed_gradients(const GradientBuffers& gradients, int sh_degree);
/// Back into buffers of as many splats; rows that are not there are 0. Throws Error where the bytes
/// are not of such gradients.
void unpack_gradients(std::span<const std::byte> bytes, int sh_degree, GradientBuffers& to);

}  // namespace darb
