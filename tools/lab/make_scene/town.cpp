// SPDX-License-Identifier: MIT
#include "tools/lab/make_scene/town.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace darb::make_scene {

namespace {

using glm::dvec3;

constexpr double kStreet = 1.2;  // width of a street, taken from a block's side
constexpr int kLots = 2;         // lots along a block's side
constexpr double kFlight = 6;    // height of the flight, world units
constexpr double kClimb = 1.5;   // added for every other view
constexpr double kTilt = 52;     // degrees below level
constexpr double kBeyond = 0.8;  // half the flight's extent, as a share of that of the town

dvec3 colour(Pcg32& rng, double least, double most) {
    return {rng.uniform(least, most), rng.uniform(least, most), rng.uniform(least, most)};
}

// Walls of stripes or tiles and a roof.
void add_house(const dvec3& at, double width, double depth, Pcg32& rng, World& world) {
    const double height = rng.uniform(0.4, 1.5);
    const Texture walls[] = {Texture::checker, Texture::tiles, Texture::dots, Texture::wood};
    Material wall{walls[rng.below(4)],
                  colour(rng, 0.25, 0.8),
                  colour(rng, 0.1, 0.5),
                  rng.uniform(0.15, 0.35),
                  0,
                  0.1};
    Material roof{Texture::tiles, colour(rng, 0.1, 0.5), colour(rng, 0.3, 0.7), 0.25, 0, 0.1};
    const dvec3 half(width / 2, depth / 2, height / 2);
    world.objects.push_back(
        {Shape::box, half, at + dvec3(0, 0, half.z), glm::dmat3(1), std::move(wall)});
    world.objects.push_back({Shape::box,
                             {half.x * 1.08, half.y * 1.08, 0.06},
                             at + dvec3(0, 0, height + 0.06),
                             glm::dmat3(1),
                             roof});
    if (rng.below(2) == 0)
        world.objects.push_back({Shape::cone,
                                 {std::min(half.x, half.y) * 0.8, 0.05, 0.2},
                                 at + dvec3(0, 0, height + 0.3),
                                 glm::dmat3(1),
                                 std::move(roof)});
}

void add_tree(const dvec3& at, Pcg32& rng, World& world) {
    const Material leaves{Texture::marble, {0.08, 0.3, 0.07}, {0.25, 0.5, 0.12}, 0.2, 0, 0.1};
    const Material trunk{Texture::wood, {0.3, 0.2, 0.1}, {0.2, 0.12, 0.06}, 0.1, 0, 0.1};
    const double radius = rng.uniform(0.18, 0.32);
    world.objects.push_back(
        {Shape::cylinder, {0.05, 0, 0.2}, at + dvec3(0, 0, 0.2), glm::dmat3(1), trunk});
    world.objects.push_back(
        {Shape::sphere, {radius, 0, 0}, at + dvec3(0, 0, 0.35 + radius), glm::dmat3(1), leaves});
}

void add_block(const dvec3& corner, Pcg32& rng, World& world) {
    constexpr double built = kTownBlockSide - kStreet;
    const Material lawn{Texture::marble, colour(rng, 0.15, 0.4), colour(rng, 0.2, 0.5), 0.7, 0, 0};
    world.objects.push_back({Shape::box,
                             {built / 2, built / 2, 0.02},
                             corner + dvec3(kTownBlockSide / 2, kTownBlockSide / 2, 0),
                             glm::dmat3(1),
                             lawn});
    constexpr double lot = built / kLots;
    for (int x = 0; x < kLots; ++x)
        for (int y = 0; y < kLots; ++y) {
            const dvec3 at =
                corner + dvec3(kStreet / 2 + (x + 0.5) * lot, kStreet / 2 + (y + 0.5) * lot, 0.02);
            const double depth = rng.uniform(0.5, 0.75) * lot, width = rng.uniform(0.5, 0.75) * lot;
            add_house(at, width, depth, rng, world);
            add_tree(at + dvec3(0.44 * lot, rng.uniform(-0.4, 0.4) * lot, 0), rng, world);
        }
}

}  // namespace

World town() {
    World world;
    Pcg32 rng(2026);
    constexpr double half = kTownBlocks * kTownBlockSide / 2;
    for (int x = 0; x < kTownBlocks; ++x)
        for (int y = 0; y < kTownBlocks; ++y)
            add_block({x * kTownBlockSide - half, y * kTownBlockSide - half, 0}, rng, world);
    world.floor = {Texture::tiles, {0.22, 0.22, 0.24}, {0.4, 0.4, 0.38}, 0.6, 0, 0};
    world.floor_z = 0;
    world.fades_from = 1e8;
    world.fades_to = 1e9;
    return world;
}

std::vector<View> town_flight(int side, double scale) {
    constexpr double half = kTownBlocks * kTownBlockSide / 2 * kBeyond;
    std::vector<View> views;
    for (int x = 0; x < side; ++x)
        for (int y = 0; y < side; ++y) {
            const int v = x * side + y;
            const double heading = glm::radians(90.0 * ((x + 2 * y) % 4) + 20.0 * (v % 3));
            const dvec3 eye(half * (2.0 * x / (side - 1) - 1), half * (2.0 * y / (side - 1) - 1),
                            kFlight + kClimb * (v % 2));
            const double reach = eye.z / std::tan(glm::radians(kTilt));
            // Keeps the picture's middle below the camera on average.
            const dvec3 forth(std::cos(heading), std::sin(heading), 0);
            View view;
            view.name = fmt::format("photo_{:03d}.png", v);
            view.camera = look_at(eye - 0.6 * reach * forth,
                                  eye + 0.4 * reach * forth - dvec3(0, 0, eye.z), scale);
            view.is_test = v % kTownTestEvery == kTownTestEvery / 2;
            views.push_back(view);
        }
    return views;
}

std::vector<View> town_walk(int count, int width) {
    constexpr double kStreetLength = 6, kEyes = 0.55, kSway = 0.15;
    std::vector<View> views;
    for (int i = 0; i < count; ++i) {
        const double way = 2 * kStreetLength * i / (count - 1);
        const bool first = way < kStreetLength;
        const double sway = kSway * std::sin(1.7 * i);
        const dvec3 eye = first ? dvec3(sway, way - kStreetLength, kEyes + 0.4 * sway)
                                : dvec3(way - kStreetLength, sway, kEyes + 0.4 * sway);
        // As a walker turns it: along the street, a little to and fro, and never quite level.
        const double heading = (first ? 90.0 : 0.0) + 14 * std::sin(0.9 * i);
        const double angle = glm::radians(heading);
        const dvec3 ahead(std::cos(angle), std::sin(angle), 0.06 * std::sin(2.3 * i));
        View view;
        view.name = fmt::format("panorama_{:03d}.png", i);
        view.camera = look_at(eye, eye + ahead, 1);
        view.camera.width = width;
        view.camera.height = width / 2;
        view.lens = {"EQUIRECTANGULAR", {double(width), double(width / 2)}, width, width / 2};
        views.push_back(view);
    }
    return views;
}

CaptureSettings town_capture(std::size_t views) {
    return {.points = kTownPointsAPhoto * static_cast<int>(views), .reach = 1e6, .samples = 6};
}

}  // namespace darb::make_scene
