#include "trainer/optimizer.h"

#include <cmath>

namespace darb {

namespace {
// In a trial, the rate of the bands above the first over that of the first.
constexpr float kTrialRestRate = 0.2f;
}  // namespace

Optimizer::Optimizer(const TrainOptions& options, const Schedule& schedule, double extent,
                     double reach, std::size_t photos)
    : schedule_(schedule),
      opacity_weight_(options.opacity_weight),
      scale_weight_(options.scale_weight),
      extent_(extent),
      reach_(reach),
      photos_(photos) {}

AdamStep Optimizer::rates(int iteration) const {
    const Schedule::Rates now = schedule_.rates(iteration);
    AdamStep step;
    step.rate[kPosition] = static_cast<float>(now.position * extent_);
    step.rate[kLogScale] = now.scale;
    step.rate[kRotation] = now.rotation;
    step.rate[kOpacityLogit] = now.opacity;
    step.rate[kShDc] = now.sh_dc;
    step.rate[kShRest] = now.sh_rest;
    step.rate[kShape] = now.shape;
    step.rest_every = schedule_.rest_every;
    return step;
}

AdamStep Optimizer::with_regularisers(AdamStep step, int iteration) const {
    step.opacity_weight = opacity_weight_;
    step.scale_weight = scale_weight_ / static_cast<float>(length());
    if (schedule_.largest_scale > 0)
        step.largest_log_scale =
            static_cast<float>(std::log(schedule_.largest_scale * schedule_.length_scale * reach_));
    step.regularise_unseen = schedule_.regularises_unseen(photos_, iteration);
    return step;
}

AdamStep Optimizer::step(int iteration) const {
    return with_regularisers(adam_step(rates(iteration), iteration), iteration);
}

AdamStep Optimizer::trial_step(int iteration, float share) const {
    AdamStep step = rates(iteration);
    step.rest_every = 1;
    step.rate[kShRest] = kTrialRestRate * step.rate[kShDc];
    for (float& rate : step.rate) rate *= share;
    return with_regularisers(adam_step(step, iteration), iteration);
}

}  // namespace darb
