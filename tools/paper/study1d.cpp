#include "tools/paper/study1d.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <mutex>

#include <fmt/format.h>

#include "engine/core/check.h"
#include "engine/core/error.h"
#include "engine/core/quantile.h"
#include "engine/reference/parallel.h"
#include "tools/paper/sim1d_terms.h"

namespace darb {

namespace {

constexpr double kFailedShare = 0.5;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

bool has_failed(const Fit1d& fit, double mean_square) {
    return !std::isfinite(fit.loss) || fit.loss >= kFailedShare * mean_square;
}

/// The kept step at which the loss first is at most target.
std::optional<int> step_of(const Fit1d& fit, const std::vector<int>& steps, double target) {
    for (std::size_t i = 0; i < fit.losses.size(); ++i)
        if (fit.losses[i] <= target) return steps[i];
    return std::nullopt;
}

void summarise(const std::vector<const Fit1d*>& good, const std::vector<int>& steps, double target,
               Study1dRow& row) {
    std::vector<double> losses, seconds, steps_to, seconds_to;
    for (const Fit1d* fit : good) {
        losses.push_back(fit->loss);
        seconds.push_back(fit->seconds);
        if (const auto step = step_of(*fit, steps, target)) {
            steps_to.push_back(*step);
            seconds_to.push_back(fit->seconds * *step / std::max(1, steps.back()));
        }
    }
    std::sort(losses.begin(), losses.end());
    row.median = quantile(losses, 0.5);
    row.quartile1 = quantile(losses, 0.25);
    row.quartile3 = quantile(losses, 0.75);
    row.low = losses.empty() ? kNaN : losses.front();
    row.high = losses.empty() ? kNaN : losses.back();
    row.seconds = median(seconds);
    row.reached = static_cast<int>(steps_to.size());
    if (!steps_to.empty()) {
        row.steps_to = median(steps_to);
        row.seconds_to = median(seconds_to);
    }
    if (good.empty()) return;
    for (std::size_t i = 0; i < steps.size(); ++i) {
        std::vector<double> at;
        for (const Fit1d* fit : good) at.push_back(fit->losses[i]);
        row.curve.push_back(median(at));
    }
    const auto nearest =
        std::min_element(good.begin(), good.end(), [&](const Fit1d* a, const Fit1d* b) {
            return std::abs(a->loss - row.median) < std::abs(b->loss - row.median);
        });
    row.shown = (*nearest)->primitives;
}

}  // namespace

Study1dResult study_1d(const Study1dOptions& options,
                       const std::function<void(std::size_t, std::size_t)>& progress) {
    DARB_CHECK(options.seeds >= 1 && !options.signals.empty() && !options.kernels.empty() &&
                   !options.primitives.empty(),
               "{} seeds", options.seeds);
    for (const int k : options.kernels)
        if (!Terms1d::draws(k))
            throw Error(fmt::format("kernel {}", kernel_1d_name(k)),
                        "has several pulses, or falls to its edge as no whole power up to the "
                        "fourth, which this study does not draw",
                        "Leave it out.");
    const auto start = std::chrono::steady_clock::now();
    Study1dResult result{options, {}, {}, 0};
    std::vector<std::vector<float>> targets;
    for (const int s : options.signals) {
        targets.push_back(
            sample_signal(signals_1d()[static_cast<std::size_t>(s)], options.fit.samples));
        double sum = 0;
        for (const float v : targets.back()) sum += double(v) * v;
        result.mean_squares.push_back(sum / options.fit.samples);
    }
    const std::size_t kernels = options.kernels.size(), counts = options.primitives.size();
    const auto seeds = static_cast<std::size_t>(options.seeds);
    for (const int s : options.signals)
        for (const int k : options.kernels)
            for (const int n : options.primitives) {
                result.rows.emplace_back();
                result.rows.back().signal = s;
                result.rows.back().kernel = k;
                result.rows.back().primitives = n;
            }
    const std::size_t tasks = result.rows.size() * seeds;
    std::vector<Fit1d> fits(tasks);
    std::mutex mutex;
    std::size_t done = 0;
    // Neighbouring tasks are seeds of one row, so that threads end together.
    reference::parallel_for(tasks, options.threads, [&](std::size_t t) {
        const Study1dRow& row = result.rows[t / seeds];
        fits[t] = fit_1d(row.kernel, targets[t / seeds / counts / kernels], row.primitives,
                         t % seeds, options.fit);
        const std::scoped_lock lock(mutex);
        progress(++done, tasks);
    });
    const std::vector<int> steps = curve_steps(options.fit.steps);
    for (std::size_t r = 0; r < result.rows.size(); ++r) {
        const double mean_square = result.mean_squares[r / counts / kernels];
        std::vector<const Fit1d*> good;
        for (std::size_t seed = 0; seed < seeds; ++seed)
            if (const Fit1d& fit = fits[r * seeds + seed]; !has_failed(fit, mean_square))
                good.push_back(&fit);
        result.rows[r].failed = static_cast<int>(seeds - good.size());
        summarise(good, steps, options.target_share * mean_square, result.rows[r]);
    }
    result.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return result;
}

}  // namespace darb
