// The step of a batch: the views one after the other into a tree of gradients, then one step of the
// optimizer of their mean.
#pragma once

#include <vector>

#include "trainer/gradient_tree.h"
#include "trainer/step.h"

namespace darb {

/// views: in the order of their places, which their inputs name. One outcome a view, in order.
std::vector<StepOutcome> run_batch_step(TrainingStep& step, GradientTree& tree,
                                        const GpuSplats& splats, std::vector<StepInput>& views);

}  // namespace darb
