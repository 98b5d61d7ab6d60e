#include "tools/bench/growth.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "engine/core/error.h"
#include "tools/bench/cases.h"
#include "tools/bench/scenes.h"
#include "trainer/step/trainer.h"

namespace darb {

namespace {

// No view-dependent colour: of 3 million splats it would be most of the memory.
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

}  // namespace darb
