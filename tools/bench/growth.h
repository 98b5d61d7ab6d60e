// SPDX-License-Identifier: MIT
// How frame and iteration time grow with splats, pixels and splat-tile intersections on the random
// scene of `darb bench`: curves with fitted exponents, as a table, JSON and a page of plots.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/report/report.h"
#include "tools/bench/measure.h"

namespace darb {

struct GrowthPoint {
    double splats = 0, pixels = 0, intersections = 0;
    Spread ms;
    std::vector<PassFigure> passes;
};

struct GrowthCurve {
    std::string name;                 // "frame" or "iteration"
    std::string by;                   // "splats" or "pixels": what varies
    std::vector<GrowthPoint> points;  // ascending
};

struct GrowthPlan {
    std::uint32_t most_splats = 1'000'000;
    int most_width = 2560;  // largest width, px, of pictures with aspect 16:9
    Sampling sampling;
};

/// Sizes that the device or its memory cannot take are left out, with a line to progress.
std::vector<GrowthCurve> measure_growth(Device& device, const GrowthPlan& plan,
                                        const std::function<void(const std::string&)>& progress);

/// The value of a point by its name: splats, pixels or intersections.
double growth_value(const GrowthPoint& point, const std::string& by);
/// The exponent b of ms = a x^b, by least squares of the logarithms over the points whose x is at
/// least a tenth of the largest; below that, fixed costs dominate. NaN with fewer than two such
/// points.
double growth_exponent(const std::vector<GrowthPoint>& points, const std::string& by);

std::string growth_table(const std::vector<GrowthCurve>& curves);
nlohmann::json growth_json(const std::vector<GrowthCurve>& curves);
/// context: context_json().
Report growth_report(const std::vector<GrowthCurve>& curves, const nlohmann::json& context);

}  // namespace darb
