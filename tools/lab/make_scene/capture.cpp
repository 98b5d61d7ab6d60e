// SPDX-License-Identifier: MIT
#include "tools/lab/make_scene/capture.h"
#include "engine/core/on_threads.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <thread>
#include <utility>

#include "engine/scene/panorama.h"

namespace darb::make_scene {

namespace {

using glm::dvec3;

constexpr double kFocal = 235;        // px
constexpr double kPointNoise = 1e-3;  // world units, standard deviation

Ray ray_through(const Camera& camera, double x, double y) {
    const dvec3 local((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1);
    return {camera.centre(), glm::normalize(glm::transpose(camera.rotation) * local)};
}

std::uint8_t to_byte(double linear) {
    const double soft = linear / (1 + 0.18 * linear);  // rolls highlights off
    return static_cast<std::uint8_t>(
        std::lround(255 * std::pow(std::clamp(soft, 0.0, 1.0), 1 / 2.2)));
}

Ray panorama_ray(const Camera& camera, double x, double y) {
    const dvec3 local = panorama_direction({x, y}, camera.width, camera.height);
    return {camera.centre(), glm::transpose(camera.rotation) * local};
}

using PixelRay = Ray (*)(const Camera&, double x, double y);

dvec3 pixel_colour(const World& world, const Camera& camera, PixelRay ray, int x, int y,
                   int samples, Pcg32& rng) {
    dvec3 sum(0.0);
    for (int i = 0; i < samples; ++i) {  // R2 sequence over the pixel
        const double u = 0.7548776662466927 * (i + 1), v = 0.5698402909980532 * (i + 1);
        const Ray through = ray(camera, x + u - std::floor(u), y + v - std::floor(v));
        sum += glm::min(radiance(world, through, rng), dvec3(4.0));
    }
    return sum / static_cast<double>(samples);
}

ImageU8 take_photo(const World& world, const View& view, std::uint64_t seed, int samples) {
    const Camera& camera = view.camera;
    const PixelRay ray = view.lens.panorama() ? panorama_ray : ray_through;
    if (samples == 0) samples = std::max(kSamples * kWidth / camera.width, 16);
    ImageU8 photo(camera.width, camera.height, 3);
    for (int y = 0; y < camera.height; ++y) {
        Pcg32 rng(seed, static_cast<std::uint64_t>(y));
        for (int x = 0; x < camera.width; ++x) {
            const dvec3 colour = pixel_colour(world, camera, ray, x, y, samples, rng);
            for (int c = 0; c < 3; ++c) photo.at(x, y, c) = to_byte(colour[c]);
        }
    }
    return photo;
}

PointCloud sample_points(const World& world, const std::vector<View>& views,
                         const std::vector<ImageU8>& photos, const CaptureSettings& settings) {
    PointCloud points;
    Pcg32 rng(7);
    while (points.size() < std::size_t(settings.points)) {
        const std::size_t v = rng.below(static_cast<std::uint32_t>(views.size()));
        const double x = rng.uniform(0, views[v].camera.width);
        const double y = rng.uniform(0, views[v].camera.height);
        const Ray ray = ray_through(views[v].camera, x, y);
        const double t = depth_along(world, ray);
        if (views[v].is_test || t < 0 || glm::length(ray.at(t)) > settings.reach) continue;
        for (int i = 0; i < 3; ++i) {
            points.position.push_back(ray.at(t)[i] + kPointNoise * rng.normal());
            points.colour.push_back(photos[v].at(static_cast<int>(x), static_cast<int>(y), i));
        }
    }
    return points;
}

/// A view of the middle of the scene; angles in radians.
View view_from(std::string name, double azimuth, double elevation, double radius, int scale) {
    const dvec3 eye(radius * std::cos(azimuth) * std::cos(elevation),
                    radius * std::sin(azimuth) * std::cos(elevation),
                    0.2 + radius * std::sin(elevation));
    View view;
    view.name = std::move(name);
    view.camera = look_at(eye, {0, 0, 0.24}, scale);
    return view;
}

constexpr int kTurns = 3;

// The path, kTurns turns at changing heights, by the share of it that lies behind, 0 to 1.
double path_azimuth(double share) {
    return kTau * kTurns * share + 0.4;
}
double path_elevation(const Heights& heights, double share) {
    return glm::radians(heights.middle + heights.swing * std::sin(kTau * 5 * share + 0.9));
}
double path_radius(double share) {
    return 3.1 + 0.35 * std::sin(kTau * 7 * share);
}

/// Elevation between the two turns of the path that lie farthest apart at this azimuth.
double between_turns(const Heights& path, double share) {
    std::array<double, kTurns> heights;
    for (int t = 0; t < kTurns; ++t) heights[t] = path_elevation(path, share + double(t) / kTurns);
    std::sort(heights.begin(), heights.end());
    const bool lower = heights[1] - heights[0] > heights[2] - heights[1];
    return lower ? (heights[0] + heights[1]) / 2 : (heights[1] + heights[2]) / 2;
}

}  // namespace

Camera look_at(const dvec3& eye, const dvec3& target, double scale) {
    const dvec3 forward = glm::normalize(target - eye);
    const dvec3 right = glm::normalize(glm::cross(forward, dvec3(0, 0, 1)));
    const dvec3 down = glm::cross(forward, right);
    Camera camera;
    camera.width = static_cast<int>(std::lround(kWidth * scale));
    camera.height = static_cast<int>(std::lround(kHeight * scale));
    camera.fx = camera.fy = kFocal * scale;
    camera.cx = camera.width / 2.0;
    camera.cy = camera.height / 2.0;
    camera.rotation = glm::transpose(glm::dmat3(right, down, forward));
    camera.translation = -(camera.rotation * eye);
    return camera;
}

std::vector<View> camera_path(int scale, const Heights& heights) {
    std::vector<View> views;
    for (int i = 0; i < kViews; ++i) {
        const double share = static_cast<double>(i) / kViews;
        views.push_back(view_from(fmt::format("view_{:02d}.png", i), path_azimuth(share),
                                  path_elevation(heights, share), path_radius(share), scale));
        views.back().is_test = i % kTestEvery == kTestOffset;
    }
    return views;
}

std::vector<View> off_path_views(int scale, const Heights& heights) {
    constexpr double kGoldenAngle = 2.399963229728653;  // spreads them evenly around
    const struct {
        const char* name;
        int count;
        double elevation, radius;  // degrees; world units. The usual path: 14 to 48, 2.75 to 3.45
    } rings[] = {{"closer", 4, 25, 1.7},
                 {"higher", 3, 72, 3.1},
                 {"lower", 3, 6, 3.1},
                 {"outside", 3, 28, 4.8}};
    std::vector<View> views;
    for (const auto& ring : rings)
        for (int i = 0; i < ring.count; ++i)
            views.push_back(view_from(fmt::format("{}_{}.png", ring.name, i),
                                      kGoldenAngle * static_cast<double>(views.size()),
                                      glm::radians(ring.elevation), ring.radius, scale));
    for (int i = 0; static_cast<int>(views.size()) < kOffPath; ++i) {
        const double share = (5.0 * i + 2) / kViews;
        views.push_back(view_from(fmt::format("between_{}.png", i), path_azimuth(share),
                                  between_turns(heights, share), 3.1, scale));
    }
    for (View& view : views) view.is_test = true;
    return views;
}

std::vector<ImageU8> take_photos(const World& world, const std::vector<View>& views,
                                 std::uint64_t seed, int samples) {
    std::vector<ImageU8> photos(views.size());
    std::atomic<std::size_t> next{0};
    const auto work = [&] {
        for (std::size_t i = next++; i < views.size(); i = next++)
            photos[i] = take_photo(world, views[i], seed + i, samples);
    };
    std::vector<JoinedThread> threads;
    for (unsigned i = 0; i < std::max(1u, std::thread::hardware_concurrency()); ++i)
        threads.emplace_back(work);
    threads.clear();
    return photos;
}

std::vector<ImageF> take_depths(const World& world, const std::vector<View>& views, double reach) {
    std::vector<ImageF> depths;
    for (const View& view : views) {
        ImageF& depth = depths.emplace_back(view.camera.width, view.camera.height, 1);
        for (int y = 0; y < depth.height; ++y)
            for (int x = 0; x < depth.width; ++x) {
                const Ray ray = ray_through(view.camera, x + 0.5, y + 0.5);
                const double t = depth_along(world, ray);
                if (t < 0 || glm::length(ray.at(t)) > reach) continue;
                const dvec3 seen = view.camera.rotation * ray.at(t) + view.camera.translation;
                depth.at(x, y, 0) = static_cast<float>(seen.z);
            }
    }
    return depths;
}

Capture capture_views(const World& world, const std::vector<View>& views,
                      const CaptureSettings& settings) {
    Capture capture;
    capture.photos = take_photos(world, views, 0, settings.samples);
    capture.points = sample_points(world, views, capture.photos, settings);
    return capture;
}

}  // namespace darb::make_scene
