// SPDX-License-Identifier: MIT
// depth_readings SCENE DATASET STEP: how far the depths of a scene are from measured ones, by each
// reading of a splat (engine/reference/reference_depth.h) and by the mean of the centres, in
// double. Looks at every STEP-th pixel of every STEP-th row of the held-out photos that have a
// depth, where a median depth exists, and prints JSON. Source of the readings: docs/math.md.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <nlohmann/json.hpp>
#include <numbers>
#include <vector>

#include "engine/core/error.h"
#include "engine/data/dataset.h"
#include "engine/data/depths.h"
#include "engine/reference/reference_depth.h"
#include "engine/reference/reference_render.h"
#include "engine/scene/splat_file.h"

namespace {

using namespace darb;

constexpr reference::Reading kReadings[] = {reference::Reading::front, reference::Reading::solid,
                                            reference::Reading::plane};
constexpr const char* kNames[] = {"front", "solid", "plane", "line", "expected"};
constexpr std::size_t kLine = 3, kExpected = 4;

/// Signed errors of a reading, world units, and the size of a pixel at each.
struct Errors {
    std::vector<double> error, pixel;
};

/// The reading `line` of one splat, whose shares of the integral are tabulated: the reference
/// integrates anew for every depth, which takes a thousand times as long.
class TabulatedLine {
  public:
    TabulatedLine(const reference::RaySlice& slice, const reference::KernelTable& kernel)
        : slice_(slice), most_(std::sqrt(std::max(slice.reach - slice.q, 0.0))) {
        for (std::size_t i = 0; i < kPanels; ++i) {
            // The middle of a panel of the angle whose sine is the place between the edges.
            const double angle = kPi * ((static_cast<double>(i) + 0.5) / kPanels - 0.5);
            const double at = most_ * std::sin(angle);
            sum_[i + 1] =
                sum_[i] + kernel.value(slice.q + at * at, slice.exponent) * std::cos(angle);
        }
    }
    /// What the splat leaves of the light up to depth z.
    double left(double z) const {
        const double t = (z - slice_.mean) / slice_.deviation;
        if (!(most_ > 0) || !(sum_[kPanels] > 0)) return t < 0 ? 1 : 1 - slice_.alpha;
        const double panel = kPanels * (std::asin(std::clamp(t / most_, -1.0, 1.0)) / kPi + 0.5);
        const auto low = std::min(static_cast<std::size_t>(panel), kPanels - 1);
        const double sum =
            sum_[low] + (panel - static_cast<double>(low)) * (sum_[low + 1] - sum_[low]);
        return std::pow(1 - slice_.alpha, sum / sum_[kPanels]);
    }
    double back() const { return slice_.mean + slice_.deviation * most_; }

  private:
    static constexpr std::size_t kPanels = 64;
    static constexpr double kPi = std::numbers::pi;
    reference::RaySlice slice_;
    double most_;  // deviations from the mean to an edge
    std::array<double, kPanels + 1> sum_{};
};

/// The depth at which half of the light is left by the reading `line`; there is one.
double line_depth(const std::vector<reference::RaySlice>& slices,
                  const reference::KernelTable& kernel, double near) {
    std::vector<TabulatedLine> lines;
    double low = near, high = near;
    for (const reference::RaySlice& slice : slices) {
        lines.emplace_back(slice, kernel);
        high = std::max(high, lines.back().back());
    }
    for (int step = 0; step < 40; ++step) {
        const double middle = 0.5 * (low + high);
        double left = 1;
        for (const TabulatedLine& line : lines) left *= line.left(middle);
        (left <= 0.5 ? high : low) = middle;
    }
    return high;
}

void add_view(const SplatModel& model, const View& view, int step, Errors (&errors)[5],
              std::size_t& looked_at) {
    const reference::RenderSettings settings;
    const ImageF truth = load_depth(view);
    const auto picture = reference::render(model, view.camera, settings);
    const auto& table = reference::kernel_table(model.kernel, model.footprint);
    for (int y = step / 2; y < truth.height; y += step)
        for (int x = step / 2; x < truth.width; x += step) {
            const double z = truth.at(x, y, 0);
            if (!(z > 0)) continue;
            ++looked_at;
            const auto slices =
                reference::ray_slices(picture.tiles, picture.projected, x, y, table, settings);
            const double left = picture.images.transmittance.at(x, y, 0);
            const double pixel = z / std::min(view.camera.fx, view.camera.fy);
            if (!depth_at_level(slices, reference::Reading::plane, table, settings)) continue;
            const auto add = [&](std::size_t reading, double depth) {
                errors[reading].error.push_back(depth - z);
                errors[reading].pixel.push_back(pixel);
            };
            for (std::size_t r = 0; r < kLine; ++r)
                if (const auto depth = depth_at_level(slices, kReadings[r], table, settings))
                    add(r, *depth);
            add(kLine, line_depth(slices, table, settings.near_z));
            add(kExpected, picture.images.depth.at(x, y, 0) / (1 - left));
        }
}

nlohmann::json statistics_of(const Errors& errors) {
    std::vector<double> sizes, sorted = errors.error;
    double mean = 0, within = 0;
    const double count = static_cast<double>(std::max<std::size_t>(errors.error.size(), 1));
    for (std::size_t i = 0; i < errors.error.size(); ++i) {
        const double size = std::abs(errors.error[i]);
        sizes.push_back(size);
        mean += size / count;
        within += (size <= errors.pixel[i]) / count;
    }
    const auto middle = [](std::vector<double>& values) {
        if (values.empty()) return 0.0;
        const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
        std::nth_element(values.begin(), at, values.end());
        return *at;
    };
    return {{"pixels", sizes.size()},
            {"mean", mean},
            {"median", middle(sizes)},
            {"bias", middle(sorted)},
            {"within_pixel", within}};
}

void measure(const char* scene, const char* folder, int step) {
    const SplatModel model = load_splats(scene);
    DatasetOptions options;
    options.hold_out = true;
    Errors errors[5];
    std::size_t looked_at = 0;
    for (const View& view : held_out_views(load_dataset(folder, options).views))
        if (!view.depth.empty()) add_view(model, view, step, errors, looked_at);
    if (looked_at == 0)
        throw Error(folder, "no held-out photo has a depth",
                    "Make it with make_scene depths or town-depths.");
    nlohmann::ordered_json report{{"pixels", looked_at}};
    for (std::size_t r = 0; r < 5; ++r) report[kNames[r]] = statistics_of(errors[r]);
    std::printf("%s\n", report.dump(1).c_str());
}

}  // namespace

int main(int argc, char** argv) {
    const int step = argc == 4 ? std::atoi(argv[3]) : 0;
    if (step < 1) {
        std::fprintf(stderr, "usage: depth_readings SCENE.ply DATASET STEP\n");
        return 2;
    }
    try {
        measure(argv[1], argv[2], step);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "error: %s\n", error.what());
        return 2;
    }
    return 0;
}
