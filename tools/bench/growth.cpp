// SPDX-License-Identifier: MIT
#include "tools/bench/growth.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "engine/core/error.h"
#include "engine/report/html.h"
#include "tools/bench/cases.h"
#include "trainer/step/trainer.h"

namespace darb {

namespace {

// No view-dependent colour, which would take most of the memory with 3 million splats.
constexpr int kShDegree = 0;
constexpr std::uint32_t kFrameSplats = 100'000, kIterationSplats = 30'000;  // where pixels vary
constexpr int kWidth = 1280;                                                // where splats vary

int height_of(int width) {
    return width * 9 / 16;
}

Camera camera_of(int width, double x) {
    return bench_camera({x, 0, 4}, true, width, height_of(width));
}

GrowthPoint point_of(const BenchResult& result, std::uint32_t splats, int width) {
    return {static_cast<double>(splats), static_cast<double>(width) * height_of(width),
            result.counts.intersections, result.ms, result.passes};
}

GrowthPoint frame(Device& device, std::uint32_t splats, int width, const Sampling& sampling) {
    const BenchResult result =
        measure_frames(device, random_scene(splats, kShDegree), camera_of(width, 0), {}, sampling);
    return point_of(result, splats, width);
}

GrowthPoint iteration(Device& device, std::uint32_t splats, int width, const Sampling& sampling) {
    Dataset dataset;
    std::vector<ImageU8> photos;
    for (const double x : {-0.1, 0.1}) {  // two, as a scene's extent is that of its cameras
        dataset.views.push_back(bench_view(camera_of(width, x), fmt::format("{}", x)));
        photos.emplace_back(width, height_of(width), 4);
        std::fill(photos.back().data.begin(), photos.back().data.end(), std::uint8_t{128});
    }
    TrainOptions options;
    options.sh_degree = kShDegree;
    options.alpha = false;
    options.densify_until = 0;
    options.resolution_ramp = false;
    Trainer trainer(device, dataset, photos, random_scene(splats, kShDegree), options);
    return point_of(measure_steps(trainer, 2, sampling), splats, width);
}

using Measure = GrowthPoint (*)(Device&, std::uint32_t splats, int width, const Sampling&);

}  // namespace

double growth_value(const GrowthPoint& point, const std::string& by) {
    return by == "splats" ? point.splats : by == "pixels" ? point.pixels : point.intersections;
}

double growth_exponent(const std::vector<GrowthPoint>& points, const std::string& by) {
    double most = 0;
    for (const GrowthPoint& p : points) most = std::max(most, growth_value(p, by));
    double n = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (const GrowthPoint& p : points) {
        if (!(growth_value(p, by) >= 0.0999 * most) || !(p.ms.median > 0)) continue;
        const double u = std::log(growth_value(p, by)), v = std::log(p.ms.median);
        n += 1;
        x += u;
        y += v;
        xx += u * u;
        xy += u * v;
    }
    const double spread = n * xx - x * x;
    if (n < 2 || !(spread > 1e-9)) return std::numeric_limits<double>::quiet_NaN();
    return (n * xy - x * y) / spread;
}

std::vector<GrowthCurve> measure_growth(Device& device, const GrowthPlan& plan,
                                        const std::function<void(const std::string&)>& progress) {
    std::vector<GrowthCurve> curves;
    const auto add = [&](GrowthCurve& curve, Measure measure, std::uint32_t splats, int width) {
        const std::string what =
            fmt::format("{} of {} splats at {}x{}", curve.name, splats, width, height_of(width));
        try {
            curve.points.push_back(measure(device, splats, width, plan.sampling));
            progress(fmt::format("{}: {:.3f} ms, {:.0f} intersections", what,
                                 curve.points.back().ms.median, curve.points.back().intersections));
        } catch (const NoRoom& e) {
            progress(fmt::format("{} is left out: {}", what, e.reason));
        }
    };
    for (const auto& [name, measure, splats] :
         {std::tuple{"frame", Measure{frame}, kFrameSplats},
          std::tuple{"iteration", Measure{iteration}, kIterationSplats}}) {
        GrowthCurve by_splats{name, "splats", {}};
        for (std::uint32_t decade = 1'000; decade <= plan.most_splats; decade *= 10)
            for (const std::uint32_t n : {decade, 3 * decade})
                if (n <= plan.most_splats) add(by_splats, measure, n, kWidth);
        curves.push_back(by_splats);
        GrowthCurve by_pixels{name, "pixels", {}};
        for (const int w : {160, 320, 640, 960, 1280, 1920, 2560})
            if (w <= plan.most_width)
                add(by_pixels, measure, std::min(splats, plan.most_splats), w);
        curves.push_back(by_pixels);
    }
    return curves;
}

// The curves of growth.h as text, JSON and a page.

namespace {

using Json = nlohmann::json;

// The points of the curve along which the number of splats, and so that of intersections, varies.
std::vector<GrowthPoint> points_by_splats(const std::vector<GrowthCurve>& curves,
                                          const std::string& name) {
    std::vector<GrowthPoint> points;
    for (const GrowthCurve& curve : curves)
        if (curve.name == name && curve.by == "splats")
            points.insert(points.end(), curve.points.begin(), curve.points.end());
    return points;
}

std::string exponent_text(double exponent) {
    return std::isfinite(exponent) ? fmt::format("{:.2f}", exponent) : "-";
}

PlotSeries series(const std::string& name, const std::vector<GrowthPoint>& points,
                  const std::string& by) {
    PlotSeries s;
    s.name = fmt::format("{}, exponent {}", name, exponent_text(growth_exponent(points, by)));
    s.dots = true;
    for (const GrowthPoint& p : points) {
        s.points.emplace_back(growth_value(p, by), p.ms.median);
        s.titles.push_back(fmt::format("{}: {} splats, {} pixels, {} intersections, {:.2f} ms",
                                       name, format_number(p.splats), format_number(p.pixels),
                                       format_number(p.intersections), p.ms.median));
    }
    return s;
}

// What is constant while the splats or the pixels vary, as text for the page.
std::string held_text(const std::vector<GrowthCurve>& curves, const std::string& name) {
    std::string text;
    for (const GrowthCurve& curve : curves) {
        if (curve.name != name || curve.points.empty()) continue;
        const GrowthPoint& p = curve.points.back();
        const bool by_splats = curve.by == "splats";
        text += fmt::format("{}{} {} where {} vary", text.empty() ? "" : " and ",
                            format_number(by_splats ? p.pixels : p.splats),
                            by_splats ? "pixels" : "splats", curve.by);
    }
    return text.empty() ? "nothing" : text;
}

Plot log_plot(const std::string& title, const std::string& x_label) {
    Plot plot{title, x_label, "ms", {}};
    plot.log_x = plot.log_y = true;
    return plot;
}

// The passes of one curve, over what varies.
Plot pass_plot(const GrowthCurve& curve) {
    Plot plot = log_plot(fmt::format("Passes, {} by {}", curve.name, curve.by), curve.by);
    if (curve.points.empty()) return plot;
    for (const PassFigure& pass : curve.points.back().passes) {
        PlotSeries s;
        s.name = pass.name;
        for (const GrowthPoint& p : curve.points)
            for (const PassFigure& one : p.passes)
                if (one.name == pass.name)
                    s.points.emplace_back(growth_value(p, curve.by), one.ms.median);
        plot.series.push_back(std::move(s));
    }
    return plot;
}

Table points_table(const GrowthCurve& curve) {
    Table table{"", fmt::format("{} by {}", curve.name, curve.by), "", {}, {}};
    for (const char* name : {"splats", "pixels", "intersections"})
        table.columns.push_back({name, "", Better::neither, 0});
    for (const char* name : {"ms", "quartiles"})
        table.columns.push_back({name, "", Better::neither, 3});
    for (const GrowthPoint& p : curve.points)
        table.rows.push_back({{p.splats, p.pixels, p.intersections, p.ms.median,
                               TableCell::between(p.ms.low, p.ms.high)}});
    return table;
}

}  // namespace

std::string growth_table(const std::vector<GrowthCurve>& curves) {
    std::string text;
    for (const GrowthCurve& curve : curves) {
        text += fmt::format("{} by {}: exponent {}, by intersections {}\n", curve.name, curve.by,
                            exponent_text(growth_exponent(curve.points, curve.by)),
                            exponent_text(growth_exponent(curve.points, "intersections")));
        text += fmt::format("{:>12} {:>12} {:>12} {:>12} {:>8}\n", "splats", "pixels",
                            "intersections", "ms", "+- %");
        for (const GrowthPoint& p : curve.points)
            text +=
                fmt::format("{:>12} {:>12} {:>12} {:>12.3f} {:>8.1f}\n", format_number(p.splats),
                            format_number(p.pixels), format_number(p.intersections), p.ms.median,
                            p.ms.median > 0 ? 50 * (p.ms.high - p.ms.low) / p.ms.median : 0.0);
    }
    return text;
}

Json growth_json(const std::vector<GrowthCurve>& curves) {
    Json all = Json::array();
    const auto number = [](double v) { return std::isfinite(v) ? Json(v) : Json(); };
    for (const GrowthCurve& curve : curves) {
        Json points = Json::array();
        for (const GrowthPoint& p : curve.points) {
            Json passes = Json::object();
            for (const PassFigure& pass : p.passes) passes[pass.name] = pass.ms.median;
            points.push_back({{"splats", p.splats},
                              {"pixels", p.pixels},
                              {"pairs", p.intersections},
                              {"ms", p.ms.median},
                              {"quartile_low", p.ms.low},
                              {"quartile_high", p.ms.high},
                              {"passes_ms", passes}});
        }
        all.push_back(
            {{"name", curve.name},
             {"by", curve.by},
             {"exponent", number(growth_exponent(curve.points, curve.by))},
             {"exponent_by_pairs", number(growth_exponent(curve.points, "intersections"))},
             {"points", points}});
    }
    return all;
}

Report growth_report(const std::vector<GrowthCurve>& curves, const Json& context) {
    Plot splats = log_plot("By splats", "splats"), pixels = log_plot("By pixels", "pixels"),
         intersections = log_plot("By splat-tile intersections", "intersections");
    std::vector<Figure> passes;
    for (const GrowthCurve& curve : curves) {
        (curve.by == "splats" ? splats : pixels)
            .series.push_back(series(curve.name, curve.points, curve.by));
        passes.push_back({"", pass_plot(curve)});
    }
    for (const char* name : {"frame", "iteration"})
        intersections.series.push_back(
            series(name, points_by_splats(curves, name), "intersections"));
    Report report(
        "Growth",
        fmt::format("{}, {}; {} x {}; {}; darb {}", context["device"].get<std::string>(),
                    context["driver"].get<std::string>(), context["num_cpus"].get<unsigned>(),
                    context["processor"].get<std::string>(), context["date"].get<std::string>(),
                    context["commit"].get<std::string>()));
    std::vector<Figure> figures{{"", splats}, {"", pixels}, {"", intersections}};
    figures.insert(figures.end(), passes.begin(), passes.end());
    report.plots(std::move(figures));
    for (const GrowthCurve& curve : curves) report.table(points_table(curve), 2);
    report.html(
        "<h2>How to read it</h2><p>Random splats in the unit sphere, seen from outside, degree "
        "0. A frame has " +
        held_text(curves, "frame") + "; an iteration (forward, loss, backward, Adam) has " +
        held_text(curves, "iteration") +
        ". Time is that of the wall clock, the median; exponents b of ms = a x^b are fitted "
        "over the largest decade, where fixed costs no longer rule.</p>\n");
    return report;
}

}  // namespace darb
