// SPDX-License-Identifier: MIT
#include "trainer/step/optimizer.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "engine/core/error.h"
#include "engine/primitives/groups.h"
#include "shaders/shared/optim_args.h"

namespace darb {

namespace {
// Rate of the bands above the first in a trial, over that of the first.
constexpr float kTrialRestRate = 0.2f;
}  // namespace

Optimizer::Optimizer(const Schedule& schedule, double extent, double reach, std::size_t photos)
    : schedule_(schedule),
      opacity_weight_(schedule.options.opacity_weight),
      scale_weight_(schedule.options.scale_weight),
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

// Rates times the root of the views, betas to their power, so that moments reach back over as many
// views as those of single ones (Zhao et al., Grendel-GS, arXiv 2406.18533). Harmonics above the
// first band that gather make their step when as many views are over, or at each of larger batches.
AdamStep Optimizer::of_batch(AdamStep step) const {
    const int views = schedule_.options.batch;
    if (views == 1) return step;
    const double gathered = schedule_.rest_every;
    step.rest_every = std::max(schedule_.rest_every / views, 1);
    const double rest_steps = step.rest_every * views / gathered;
    for (int a = 0; a < kAttributeCount; ++a)
        step.rate[static_cast<std::size_t>(a)] *=
            static_cast<float>(std::sqrt(a == kShRest ? rest_steps : views));
    step.rest_beta1 = std::pow(step.beta1, rest_steps);
    step.rest_beta2 = std::pow(step.beta2, rest_steps);
    step.beta1 = std::pow(step.beta1, views);
    step.beta2 = std::pow(step.beta2, views);
    return step;
}

AdamStep Optimizer::with_regularisers(AdamStep step, int iteration) const {
    step.opacity_weight = opacity_weight_;
    step.scale_weight = scale_weight_ / static_cast<float>(length());
    if (schedule_.lays_on_surfaces(iteration))
        step.flatness_weight = schedule_.options.flatness_weight / static_cast<float>(length());
    if (schedule_.largest_scale > 0)
        step.largest_log_scale =
            static_cast<float>(std::log(schedule_.largest_scale * schedule_.length_scale * reach_));
    const int begin = schedule_.step_begin(iteration);
    int unseen = 0;
    for (int i = begin + 1; i <= iteration; ++i)
        unseen += schedule_.regularises_unseen(photos_, i) ? 1 : 0;
    step.regularise_unseen = static_cast<float>(unseen) / static_cast<float>(iteration - begin);
    return step;
}

AdamStep Optimizer::step(int iteration) const {
    const int steps = (iteration - 1) / schedule_.options.batch + 1;
    return with_regularisers(adam_step(of_batch(rates(iteration)), steps), iteration);
}

AdamStep Optimizer::trial_step(int iteration, float share) const {
    AdamStep step = rates(iteration);
    step.rest_every = 1;
    step.rate[kShRest] = kTrialRestRate * step.rate[kShDc];
    for (float& rate : step.rate) rate *= share;
    return with_regularisers(adam_step(step, iteration), iteration);
}

namespace {
std::string mean_name(int attribute) {
    return std::string("mean of ") + attribute_name(attribute);
}
}  // namespace

IterateAverage::IterateAverage(Device& device)
    : device_(&device),
      commands_(device),
      average_(device, "average", SpecConstants{{"THREADS", SPLAT_GROUP}}) {}

void IterateAverage::add(const GpuSplats& splats) {
    for (int a = 0; count_ > 0 && a < kAttributeCount; ++a)
        if (const std::uint64_t bytes = splats.rows(a).bytes(splats.count());
            bytes > 0 && mean_[a].bytes() != bytes)
            throw Error(mean_name(a),
                        fmt::format("holds {} bytes, the splats {}", mean_[a].bytes(), bytes),
                        "Call clear() where the splats became others.");
    if (count_ == 0)
        for (int a = 0; a < kAttributeCount; ++a)
            mean_[a] = Buffer(*device_, mean_name(a), splats.rows(a).bytes(splats.count()));
    const float share = 1.0f / static_cast<float>(++count_);
    commands_.begin();
    commands_.pass("average");
    for (int a = 0; a < kAttributeCount; ++a) {
        const Buffer& value = splats.parameters(a);
        const AttributeRows rows = splats.rows(a);
        const std::uint64_t bytes = rows.bytes(splats.count());
        if (bytes == 0) continue;
        if (count_ == 1) {
            commands_.copy(value, mean_[a], bytes);
            continue;
        }
        for (const SplatRange& range : splats.ranges()) {
            const gpu::AverageArgs args{static_cast<std::uint32_t>(rows.bytes(range.count) / 4),
                                        share};
            const Groups g = groups_for(args.count);
            commands_.dispatch(
                average_, args,
                {range_of_rows(value, rows, range), range_of_rows(mean_[a], rows, range)}, g.x,
                g.y);
        }
    }
    commands_.submit_and_wait();
}

void IterateAverage::swap(GpuSplats& splats) {
    if (count_ == 0) return;
    for (int a = 0; a < kAttributeCount; ++a) std::swap(splats.parameters(a), mean_[a]);
}

void IterateAverage::clear() {
    count_ = 0;
    mean_ = {};
}

std::vector<std::vector<float>> IterateAverage::state(const GpuSplats& splats) const {
    std::vector<std::vector<float>> state;
    if (count_ == 0) return state;
    for (int a = 0; a < kAttributeCount; ++a)
        state.push_back(download_rows(mean_[a], splats.rows(a), splats.count()));
    return state;
}

void IterateAverage::restore(const std::vector<std::vector<float>>& state, std::uint32_t count,
                             const GpuSplats& splats) {
    clear();
    if (state.empty()) return;
    count_ = count;
    for (int a = 0; a < kAttributeCount; ++a) {
        mean_[a] = Buffer(*device_, mean_name(a), splats.rows(a).bytes(splats.count()));
        upload_rows(mean_[a], splats.rows(a), state[a]);
    }
}

}  // namespace darb
