// SPDX-License-Identifier: MIT
#include "engine/render/orthophoto.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "engine/core/error.h"
#include "engine/core/quantile.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/subject.h"

namespace darb {

namespace {

constexpr int kTile = 512;         // px
constexpr double kParallax = 0.1;  // px: how far off a tile's corner is at the farthest depth
constexpr double kReach = 1.1;     // of the radius of the scene's dense part: what counts
constexpr double kLeftOut = 2e-3;  // of the splats, at each end of each axis
constexpr double kMargin = 0.02;   // of a side
constexpr double kLeastOpacity = 0.1;
constexpr int kMostSide = 32'768;  // px

// Right, down and forward for a viewer on the side `from`.
glm::dmat3 axes_for(const OrthophotoOptions& options) {
    const glm::dvec3 forward = -glm::normalize(options.from);
    glm::dvec3 up = options.up;
    if (std::abs(glm::dot(up, forward)) > 0.9)
        up = options.north != glm::dvec3(0.0) ? options.north
             : std::abs(forward.y) < 0.9      ? glm::dvec3(0, 1, 0)
                                              : glm::dvec3(0, 0, 1);
    const glm::dvec3 down = glm::normalize(forward * glm::dot(up, forward) - up);
    return glm::transpose(glm::dmat3(glm::cross(down, forward), down, forward));
}

struct Extent {
    glm::dvec3 least{0.0}, most{0.0};  // in the picture's axes
};

Extent extent_of(const SplatModel& model, const glm::dmat3& axes) {
    std::array<std::vector<double>, 3> at;
    const float least = static_cast<float>(std::log(kLeastOpacity / (1 - kLeastOpacity)));
    const Bounds dense = dense_bounds(model);
    for (std::size_t i = 0; i < model.size(); ++i) {
        const glm::dvec3 at_world = position_of(model, i);
        if (model.opacity_logit[i] < least ||
            glm::distance(at_world, dense.centre) > kReach * dense.radius)
            continue;
        const glm::dvec3 p = axes * at_world;
        for (glm::length_t k = 0; k < 3; ++k) at[static_cast<std::size_t>(k)].push_back(p[k]);
    }
    if (at[0].empty())
        throw Error("--projection orthographic", "no splat of the scene can be seen",
                    "Check the scene with darb info.");
    Extent extent;
    for (glm::length_t k = 0; k < 3; ++k) {
        std::vector<double>& values = at[static_cast<std::size_t>(k)];
        extent.least[k] = nearest_rank(values, kLeftOut);
        extent.most[k] = nearest_rank(values, 1 - kLeftOut);
        const double margin = kMargin * (extent.most[k] - extent.least[k]);
        extent.least[k] -= margin;
        extent.most[k] += margin;
    }
    return extent;
}

/// The axis that a direction is along, 0 to 2, or nothing.
std::optional<glm::length_t> axis_of(const glm::dvec3& direction) {
    for (glm::length_t k = 0; k < 3; ++k)
        if (std::abs(direction[k]) > 1 - 1e-9) return k;
    return std::nullopt;
}

}  // namespace

Orthophoto orthophoto_of(const SplatModel& model, const OrthophotoOptions& options) {
    Orthophoto photo;
    photo.axes = axes_for(options);
    const Extent extent = extent_of(model, photo.axes);
    const glm::dvec3 size = extent.most - extent.least;
    photo.pixel = options.pixel > 0 ? options.pixel : std::max(size.x, size.y) / options.longest;
    const double width = std::ceil(size.x / photo.pixel), height = std::ceil(size.y / photo.pixel);
    if (!(photo.pixel > 0) || !(width <= kMostSide && height <= kMostSide))
        throw Error("--pixel",
                    fmt::format("the picture would be {:.0f} x {:.0f} px with pixels of {:g}",
                                width, height, photo.pixel),
                    fmt::format("Use --pixel {:.3g} or more, which makes {} px.",
                                std::max(size.x, size.y) / kMostSide, kMostSide));
    photo.width = std::max(1, static_cast<int>(width));
    photo.height = std::max(1, static_cast<int>(height));
    photo.corner = glm::transpose(photo.axes) * extent.least;
    photo.depth = std::max(size.z, photo.pixel);
    return photo;
}

std::vector<OrthophotoTile> tiles_of(const Orthophoto& photo) {
    std::vector<OrthophotoTile> tiles;
    // A point at half the depth from the middle is off by tile/2 px * (depth/2) / distance.
    const double distance = 0.25 * kTile * photo.depth / kParallax;
    const glm::dvec3 corner = photo.axes * photo.corner;
    for (int y = 0; y < photo.height; y += kTile)
        for (int x = 0; x < photo.width; x += kTile) {
            OrthophotoTile tile;
            tile.x = x;
            tile.y = y;
            Camera& camera = tile.camera;
            camera.width = std::min(kTile, photo.width - x);
            camera.height = std::min(kTile, photo.height - y);
            camera.cx = 0.5 * camera.width;
            camera.cy = 0.5 * camera.height;
            camera.fx = camera.fy = (distance + 0.5 * photo.depth) / photo.pixel;
            camera.rotation = photo.axes;
            camera.translation = {-(corner.x + (x + camera.cx) * photo.pixel),
                                  -(corner.y + (y + camera.cy) * photo.pixel), distance - corner.z};
            tile.near_plane = static_cast<float>(distance);
            tiles.push_back(tile);
        }
    return tiles;
}

ImageU8 draw_orthophoto(const Orthophoto& photo, const RenderTile& render) {
    ImageU8 picture(photo.width, photo.height, 3);
    for (const OrthophotoTile& tile : tiles_of(photo)) {
        const ImageU8 part = render(tile);
        for (int y = 0; y < part.height; ++y)
            std::copy_n(
                &part.data[3 * static_cast<std::size_t>(y) * static_cast<std::size_t>(part.width)],
                3 * static_cast<std::size_t>(part.width),
                &picture.data[3 * (static_cast<std::size_t>(tile.y + y) *
                                       static_cast<std::size_t>(photo.width) +
                                   static_cast<std::size_t>(tile.x))]);
    }
    return picture;
}

MapFrame map_of(const SplatModel& model) {
    return {model.metres_per_unit, model.place.rotation, model.place.offset};
}

std::optional<std::string> world_file(const Orthophoto& photo, const MapFrame& map) {
    const glm::dmat3 rows = glm::transpose(photo.axes);
    const glm::dvec3 to_right = map.rotation * rows[0], to_below = map.rotation * rows[1];
    const auto right = axis_of(to_right), down = axis_of(to_below);
    if (!right || !down) return std::nullopt;
    const double pixel = map.scale * photo.pixel;
    const glm::dvec3 first = map.scale * (map.rotation * photo.corner) + map.offset +
                             0.5 * pixel * (to_right + to_below);
    return fmt::format("{:.12g}\n0\n0\n{:.12g}\n{:.12g}\n{:.12g}\n", pixel * to_right[*right],
                       pixel * to_below[*down], first[*right], first[*down]);
}

}  // namespace darb
