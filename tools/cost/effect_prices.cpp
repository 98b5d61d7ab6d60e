// SPDX-License-Identifier: MIT
#include "tools/cost/effect_prices.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "engine/core/say.h"
#include "engine/plan/tuner.h"
#include "engine/render/renderer.h"
#include "trainer/growth/initial_model.h"
#include "trainer/job/job.h"
#include "trainer/step/trainer.h"

namespace darb {

namespace {

constexpr int kFrames = 15, kWarmUp = 3;
constexpr std::size_t kViews = 4;

Measured summary(std::vector<double> ms, std::uint64_t bytes, std::uint32_t huge,
                 std::uint32_t longest) {
    std::sort(ms.begin(), ms.end());
    const std::size_t n = ms.size();
    return {ms[n / 2], 0.5 * (ms[n - 1 - n / 4] - ms[n / 4]), bytes, huge, longest};
}

double sum_of(const std::vector<PassTime>& passes) {
    double ms = 0;
    for (const PassTime& pass : passes) ms += pass.ms;
    return ms;
}

}  // namespace

Measured measure_rendering(const DeviceOptions& device_options, const SplatModel& model,
                           const std::vector<View>& views, const EffectPlan& plan) {
    Device device(device_options);
    settle_tuning(device);
    SplatModel planned = model;
    apply_plan(plan, planned);
    std::vector<View> seen = views;
    apply_plan(plan, seen);
    Renderer renderer(device, planned, Accuracy{}, plan.projection(), plan.huge_splat_path());
    std::vector<double> ms;
    std::uint32_t huge = 0, longest = 0;
    const std::size_t count = std::min(views.size(), kViews);
    for (std::size_t frame = 0; frame < kWarmUp * count + kFrames; ++frame) {
        renderer.render(seen[frame % count].camera);
        double frame_ms = sum_of(renderer.pass_times());
        huge = std::max(huge, renderer.status().huge_splats);
        longest = std::max(longest, renderer.status().longest_list);
        if (plan.on(EFFECT_DEPTH)) {
            renderer.render_depth();
            frame_ms += sum_of(renderer.pass_times());
        }
        if (frame >= kWarmUp * count) ms.push_back(frame_ms);
    }
    return summary(ms, device.peak_bytes(), huge, longest);
}

Measured measure_training(const DeviceOptions& device_options, const Dataset& dataset,
                          const TrainOptions& options, const EffectPlan& plan) {
    Device device(device_options);
    settle_tuning(device);
    Dataset few = dataset;
    std::erase_if(few.views, [](const View& v) { return v.is_test; });
    apply_plan(plan, few.views);
    few.views.resize(std::min(few.views.size(), kViews));
    few.points.seen_begin.clear();
    few.points.seen_by.clear();
    std::vector<ImageU8> photos;
    for (const View& v : few.views) {
        photos.emplace_back(v.camera.width, v.camera.height, 4);
        std::fill(photos.back().data.begin(), photos.back().data.end(), std::uint8_t{128});
    }
    TrainOptions planned = options;
    apply_plan(plan, planned);
    planned.probe_sh = false;
    planned.densify_until = 0;
    planned.resolution_ramp = false;
    planned.sh_interval = 1;  // every band is in use after a few steps
    Trainer trainer(device, few, photos, initial_model(few, planned), planned);
    std::vector<double> ms;
    for (int step = 0; step < 2 * static_cast<int>(kViews) + kFrames; ++step) {
        const auto start = std::chrono::steady_clock::now();
        trainer.step();
        trainer.drain();
        const std::chrono::duration<double, std::milli> took =
            std::chrono::steady_clock::now() - start;
        if (step >= 2 * static_cast<int>(kViews)) ms.push_back(took.count());
    }
    return summary(ms, device.peak_bytes(), trainer.counters().huge_splats,
                   trainer.counters().longest_list);
}

EffectPrices price_effects(const EffectPlan& plan, const Measured& base,
                           const std::vector<int>& effects, int most_degree,
                           const std::function<Measured(const EffectPlan&)>& with) {
    EffectPrices prices(EFFECT_COUNT);
    for (const int e : effects) {
        EffectPlan other = plan;
        EffectRow& row = other.row(e);
        row.on = !row.on;
        row.overridden = true;
        if (e == EFFECT_VIEW_COLOUR) row.degree = row.on ? most_degree : 0;
        const Measured changed = with(other);
        const double sign = plan.on(e) ? 1 : -1;
        prices[static_cast<std::size_t>(e)] = {
            sign * (base.ms - changed.ms),
            static_cast<std::int64_t>(sign) *
                (static_cast<std::int64_t>(base.bytes) - static_cast<std::int64_t>(changed.bytes)),
            std::hypot(base.spread_ms, changed.spread_ms)};
    }
    return prices;
}

nlohmann::json priced_json(const EffectPlan& plan, const EffectPrices& prices) {
    nlohmann::json rows = plan_json(plan);
    for (std::size_t e = 0; e < prices.size(); ++e)
        if (prices[e])
            rows[e]["price"] = {{"ms", prices[e]->ms},
                                {"spread_ms", prices[e]->spread_ms},
                                {"bytes", prices[e]->bytes}};
    return rows;
}

void print_priced(std::FILE* out, const EffectPlan& plan, const EffectPrices& prices,
                  bool training) {
    const char* ms_of = training ? "ms/iter" : "ms/frame";
    tell(out, "{:<10}  {:<3}  {:>9} {:>7}  {:>9}  reason\n", "effect", "", ms_of, "spread", "MB");
    for (int e = 0; e < EFFECT_COUNT; ++e) {
        const EffectRow& row = plan.row(e);
        std::string ms = "-", spread, mb = "-";
        if (const auto at = static_cast<std::size_t>(e); at < prices.size() && prices[at]) {
            const bool apart = std::abs(prices[at]->ms) > prices[at]->spread_ms;
            ms = apart ? fmt::format("{:+.2f}", prices[at]->ms) : "~0";
            spread = fmt::format("{:.2f}", prices[at]->spread_ms);
            mb = fmt::format("{:+.2f}", static_cast<double>(prices[at]->bytes) / 1e6);
        }
        tell(out, "{:<10}  {:<3}  {:>9} {:>7}  {:>9}  {}\n", effect_name(e), row.on ? "on" : "off",
             ms, spread, mb, row.reason);
    }
    if (!prices.empty()) tell(out, "~0: no more than what measuring it again changes (spread)\n");
}

}  // namespace darb
