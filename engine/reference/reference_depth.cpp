// SPDX-License-Identifier: MIT
#include "engine/reference/reference_depth.h"

#include <algorithm>
#include <cmath>

namespace darb::reference {

namespace {

double slice_alpha(const RaySlice& s, double offset, const KernelTable& kernel,
                   const RenderSettings& settings) {
    const double t = offset / s.deviation, q = s.q + t * t;
    if (q > s.reach) return 0;
    const double a = std::min(s.strength * kernel.value(q, s.exponent), s.alpha);
    return a >= settings.alpha_cutoff ? a : 0;
}

/// Integral of the profile along the ray from the front edge to `t` deviations behind the mean, by
/// Simpson's rule in the angle whose sine is t: the edges, where some profiles fall like a root,
/// are smooth in it.
double integral(const RaySlice& s, double t, const KernelTable& kernel) {
    constexpr int kPanels = 256;
    const double most = std::sqrt(std::max(s.reach - s.q, 0.0));
    if (!(most > 0)) return 0;
    const double from = -std::asin(1.0), to = std::asin(std::clamp(t / most, -1.0, 1.0));
    double sum = 0;
    for (int i = 0; i <= kPanels; ++i) {
        const double angle = from + (to - from) * i / kPanels, at = most * std::sin(angle);
        const double weight = i == 0 || i == kPanels ? 1 : i % 2 == 1 ? 4 : 2;
        sum += weight * kernel.value(s.q + at * at, s.exponent) * most * std::cos(angle);
    }
    return sum * (to - from) / kPanels / 3;
}

double left_by(const RaySlice& s, double z, Reading reading, const KernelTable& kernel,
               const RenderSettings& settings) {
    const double offset = z - s.mean;
    const bool behind = offset >= 0;
    if (reading == Reading::plane) return behind ? 1 - s.alpha : 1;
    if (reading == Reading::line) {
        const double most = std::sqrt(std::max(s.reach - s.q, 0.0));
        const double whole = integral(s, most, kernel);
        const double share =
            whole > 0 ? integral(s, offset / s.deviation, kernel) / whole : (behind ? 1.0 : 0.0);
        return std::pow(1 - s.alpha, share);
    }
    const double a = slice_alpha(s, offset, kernel, settings);
    if (reading == Reading::front) return behind ? 1 - s.alpha : 1 - a;
    return behind ? (1 - s.alpha) / std::sqrt(1 - a) : std::sqrt(1 - a);
}

}  // namespace

std::vector<RaySlice> ray_slices(const TileLists& lists,
                                 const std::vector<ProjectedSplat<double>>& splats, int x, int y,
                                 const KernelTable& kernel, const RenderSettings& settings) {
    std::vector<RaySlice> slices;
    const size_t tile = size_t(y / kTileSize) * lists.tiles_x + x / kTileSize;
    double left = 1;
    for (std::uint32_t k = lists.begin[tile]; k < lists.begin[tile + 1]; ++k) {
        const ProjectedSplat<double>& p = splats[lists.splats[k]];
        const double dx = p.mean_px.x - (x + 0.5), dy = p.mean_px.y - (y + 0.5);
        const double u = p.l11 * dx + p.l21 * dy, v = p.l22 * dy, q = u * u + v * v;
        const double w = kernel.value(q, p.exponent);
        const double alpha = std::min(ALPHA_MAX, p.opacity * w);
        if (alpha < settings.alpha_cutoff) continue;
        if (left * (1 - alpha) < settings.transmittance_stop * (1 - TRANSMITTANCE_SLACK)) break;
        left *= 1 - alpha;
        slices.push_back({alpha, alpha / w, q, p.reach,
                          p.depth - p.depth_slope.x * u - p.depth_slope.y * v, p.depth_deviation,
                          p.exponent});
    }
    return slices;
}

double light_left(const std::vector<RaySlice>& slices, double z, Reading reading,
                  const KernelTable& kernel, const RenderSettings& settings) {
    double left = 1;
    for (const RaySlice& s : slices) left *= left_by(s, z, reading, kernel, settings);
    return left;
}

std::optional<double> depth_at_level(const std::vector<RaySlice>& slices, Reading reading,
                                     const KernelTable& kernel, const RenderSettings& settings,
                                     double level) {
    double end = 1, high = settings.near_z;
    for (const RaySlice& s : slices) {
        end *= 1 - s.alpha;
        high = std::max(high, s.mean + s.deviation * std::sqrt(std::max(s.reach - s.q, 0.0)));
    }
    if (end > level) return std::nullopt;
    double low = settings.near_z;
    if (light_left(slices, low, reading, kernel, settings) <= level) return low;
    for (int step = 0; step < 60; ++step) {
        const double middle = 0.5 * (low + high);
        (light_left(slices, middle, reading, kernel, settings) <= level ? high : low) = middle;
    }
    return high;
}

}  // namespace darb::reference
