#include "trainer/batch_step.h"

namespace darb {

namespace {

void add_times(const std::vector<PassTime>& passes, StepOutcome& outcome) {
    outcome.passes.insert(outcome.passes.end(), passes.begin(), passes.end());
}

}  // namespace

std::vector<StepOutcome> run_batch_step(TrainingStep& step, GradientTree& tree,
                                        const GpuSplats& splats, std::vector<StepInput>& views) {
    std::vector<StepOutcome> outcomes;
    tree.reserve(splats);
    tree.begin();
    for (StepInput& view : views) {
        const bool last = &view == &views.back();
        view.gradients = &tree.leaf();
        StepOutcome outcome = step.run_view(view);
        outcome.ends_step = last;
        add_times(step.work([&](Commands& commands) {
            tree.record_view(commands);
            if (last) tree.record_end(commands);
        }),
                  outcome);
        outcomes.push_back(std::move(outcome));
    }
    add_times(step.run_update(views, tree.sum()), outcomes.back());
    return outcomes;
}

}  // namespace darb
