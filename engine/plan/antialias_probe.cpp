// SPDX-License-Identifier: MIT
#include "engine/plan/antialias_probe.h"

#include <fmt/format.h>
#include <string>

namespace darb {

namespace {

// Largest loss at the trained size. Short runs lose more there than long ones:
// docs/experiments/antialiasing.md.
constexpr double kMostLoss_db = 1;

}  // namespace

double AntialiasProbe::gain_db() const {
    double sum = 0;
    for (const ProbedSize& size : sizes) sum += size.with_db - size.without_db;
    return sum / double(sizes.size());
}

bool AntialiasProbe::pays() const {
    for (const ProbedSize& size : sizes)
        if (size.scale == 1 && size.without_db - size.with_db > kMostLoss_db) return false;
    return gain_db() > 0;
}

void take_probe(const AntialiasProbe& probe, EffectPlan& plan) {
    EffectRow& row = plan.row(EFFECT_ANTIALIAS);
    std::string gains;
    for (const ProbedSize& size : probe.sizes)
        gains += fmt::format("{}{:+.2f} dB at {:g}x", gains.empty() ? "" : ", ",
                             size.with_db - size.without_db, size.scale);
    std::string reason = fmt::format("a probe: {}", gains);
    if (!probe.pays() && probe.gain_db() > 0)
        reason += fmt::format("; more than {} dB are lost at the trained size", kMostLoss_db);
    if (probe.sizes.back().scale <= 1)
        reason += "; the photos are no larger, a smaller -r would show more";
    if (row.overridden) {
        row.reason = fmt::format("--effects; {}", reason);
        return;
    }
    row = {probe.pays(), false, 0, probe.gain_db(), reason};
}

std::string Trial::advice() const {
    const std::string measured =
        fmt::format("{:+.2f} dB on held-out photos for {:+.0f} % of time", gain_db(), 100 * price);
    return pays() ? fmt::format("{}: train with {}", measured, tried)
                  : fmt::format("{}: stay with {}; less than {} dB may be chance", measured, usual,
                                kLeastGain_db);
}

}  // namespace darb
