// SPDX-License-Identifier: MIT
#include "engine/raster/median_depth.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "engine/core/error.h"
#include "engine/kernels/kernel_family.h"
#include "engine/primitives/groups.h"
#include "engine/raster/forward.h"

namespace darb {

namespace {

constexpr std::uint32_t kBlocksOfTile = 4, kBlockPixels = 64;
constexpr std::uint32_t kWalks = 7;                              // each leaves a ninth of a bracket
constexpr std::int32_t kSplatsOnCpu = 2048, kSplatsOnGpu = 512;  // of a block, in shared memory
constexpr std::uint32_t kMostRays = 8;                           // points of a thread

std::uint64_t pixel_bytes(std::uint32_t segments) {
    const std::uint64_t products = segments > 1 ? MEDIAN_SAMPLES * sizeof(float) : 0;
    return sizeof(glm::vec4) + sizeof(std::uint32_t) + products + sizeof(glm::vec2);
}

void hold(Device& device, Buffer& buffer, const char* name, std::uint64_t bytes) {
    if (buffer && buffer.bytes() >= bytes) return;
    buffer = Buffer();  // never an old and a new one at a time
    buffer = Buffer(device, name, bytes, Memory::device, "median depth");
}

std::uint32_t segments_of(std::uint32_t longest_list) {
    return std::max(1u, (longest_list + MEDIAN_SEGMENT - 1) / MEDIAN_SEGMENT);
}

// Of the passes that include forward/ray_slice.glsl; a block of 8 x 8 pixels has PIXELS a thread.
SpecConstants ray_constants(const Device& device, const ForwardOptions& options,
                            DepthReading reading) {
    DARB_CHECK(reading != DepthReading::expected);
    if (kernel_pulses(options.kernel) > 1 && reading != DepthReading::plane)
        throw Error("depth",
                    fmt::format("the kernel {} rises again beyond its first pulse, so that the "
                                "light along a ray has no single middle",
                                kernel_name(options.kernel)),
                    "Read the depth as `plane` or `expected`.");
    SpecConstants constants = kernel_constants(device, options);
    constants["READING"] = static_cast<std::int32_t>(reading);
    constants["MIN_TRANSMITTANCE"] = least_transmittance(options.transmittance_stop);
    constants["THREADS"] = static_cast<std::int32_t>(add_block_constants(device, constants));
    return constants;
}

/// Points of a view by the block of 8 x 8 pixels that they are in.
struct SortedPoints {
    std::vector<ViewPoint> points;
    std::vector<std::uint32_t> from;  // [P] their places before
    std::vector<glm::uvec4> items;    // tile, block, first point, points
};

SortedPoints sorted_by_block(std::span<const ViewPoint> points, const gpu::CameraData& camera,
                             std::uint32_t points_of_item) {
    constexpr std::uint32_t kBlock = TILE_SIZE / 2;
    const std::uint32_t tiles = camera.tiles_x * camera.tiles_y;
    const auto block_of = [&](const ViewPoint& p) {
        const std::uint32_t x =
            std::min(static_cast<std::uint32_t>(p.x), camera.width - 1) / kBlock;
        const std::uint32_t y =
            std::min(static_cast<std::uint32_t>(p.y), camera.height - 1) / kBlock;
        return kBlocksOfTile * (y / 2 * camera.tiles_x + x / 2) + 2 * (y % 2) + x % 2;
    };
    std::vector<std::uint32_t> begin(kBlocksOfTile * tiles + 1, 0);
    for (const ViewPoint& p : points) {
        DARB_CHECK(
            p.x >= 0 && p.y >= 0 && p.x <= float(camera.width) && p.y <= float(camera.height),
            "a point at {}, {} of {} x {} px", p.x, p.y, camera.width, camera.height);
        ++begin[block_of(p) + 1];
    }
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    SortedPoints sorted;
    for (std::uint32_t block = 0; block + 1 < begin.size(); ++block)
        for (std::uint32_t first = begin[block]; first < begin[block + 1]; first += points_of_item)
            sorted.items.emplace_back(block / kBlocksOfTile, block % kBlocksOfTile, first,
                                      std::min(points_of_item, begin[block + 1] - first));
    sorted.points.resize(points.size());
    sorted.from.resize(points.size());
    for (std::uint32_t i = 0; i < points.size(); ++i) {
        const std::uint32_t to = begin[block_of(points[i])]++;
        sorted.points[to] = points[i];
        sorted.from[to] = i;
    }
    return sorted;
}

}  // namespace

std::optional<DepthReading> depth_reading_from_name(std::string_view name) {
    for (std::size_t i = 0; i < std::size(kDepthReadings); ++i)
        if (kDepthReadings[i] == name) return static_cast<DepthReading>(i);
    return std::nullopt;
}

DepthReading usual_reading(int kernel) {
    return kernel_pulses(kernel) > 1 ? DepthReading::plane : DepthReading::front;
}

DepthPlanes::DepthPlanes(Device& device, const ForwardOptions& options) : device_(&device) {
    SpecConstants plane = kernel_constants(device, options);
    plane["PROJECTION"] = options.projection;
    add_constants(options.effects, plane);
    plane = for_several_passes(std::move(plane));
    plane["THREADS"] = SPLAT_GROUP;
    pass_ = Pipeline(device, "depth_plane", plane);
}

void DepthPlanes::record(Commands& commands, const GpuSplats& splats, const FrameView& view,
                         const Frame& frame) {
    hold(*device_, planes_, "splat planes", splats.count() * sizeof(glm::vec3));
    if (splats.count() == 0) return;
    commands.pass("depth planes");
    const Groups g = groups_for(splats.count());
    commands.dispatch(
        pass_,
        gpu::DepthPlaneArgs{splats.count(), view.index, static_cast<float>(LOW_PASS_DEFAULT)},
        {*view.cameras, splats.parameters(kPosition), splats.parameters(kLogScale),
         splats.parameters(kRotation), splats.parameters(kShape), splats.smoothing(),
         frame.splats.visible, planes_},
        g.x, g.y);
}

MedianDepth::MedianDepth(Device& device, const ForwardOptions& options, DepthReading reading)
    : device_(&device), planes_(device, options) {
    SpecConstants shared = ray_constants(device, options, reading);
    const std::uint32_t subgroup = blend_subgroup(device);
    bracket_pass_ = Pipeline(device, "depth_bracket", shared, true, subgroup);
    // A CPU has room for the splats of any block but the fullest; on a GPU they would keep others
    // out.
    SpecConstants search = shared;
    search["BLOCK_SPLATS"] = device.info().type == "cpu" ? kSplatsOnCpu : kSplatsOnGpu;
    search_ = Pipeline(device, "median_search", search, true, subgroup);
    shared["PIXELS"] = 1;
    shared["SAMPLES"] = static_cast<std::int32_t>(MEDIAN_SAMPLES);
    walk_ = Pipeline(device, "median_depth", shared, true, subgroup);
}

std::uint64_t MedianDepth::device_bytes(std::uint32_t splats, std::uint64_t pixels) {
    return splats * sizeof(glm::vec3) + pixels * pixel_bytes(1);
}

void MedianDepth::reserve(std::uint64_t pixels, std::uint32_t segments) {
    hold(*device_, bracket_, "depth brackets", pixels * sizeof(glm::vec4));
    hold(*device_, ends_, "ends of lists", pixels * sizeof(std::uint32_t));
    hold(*device_, product_, "light at depths",
         segments > 1 ? pixels * MEDIAN_SAMPLES * sizeof(float) : 4);
    hold(*device_, depth_, "median depth", pixels * sizeof(glm::vec2));
}

void MedianDepth::record(Commands& commands, const GpuSplats& splats, const FrameView& view,
                         const Frame& frame, std::uint32_t longest_list, float level) {
    DARB_CHECK(level > 0 && level < 1, "level = {}", level);
    const gpu::CameraData& camera = view.camera;
    const std::uint32_t segments = segments_of(longest_list);
    reserve(std::uint64_t(camera.width) * camera.height, segments);
    const ProjectedSplats& s = frame.splats;
    const TileIntersections& t = frame.intersections;
    planes_.record(commands, splats, view, frame);
    commands.pass("median depth");
    std::vector<BufferRange> buffers{t.tile_range,
                                     t.intersection_from_sorted,
                                     t.splat_from_intersection,
                                     s.shape,
                                     s.light,
                                     s.bound,
                                     s.exponent,
                                     planes_.planes(),
                                     bracket_,
                                     ends_,
                                     depth_};
    const auto walk = [&](const Pipeline& pipeline, std::uint32_t parts) {
        for (std::uint32_t part = 0; part < parts; ++part)
            commands.dispatch(pipeline,
                              gpu::MedianDepthArgs{camera.width, camera.height, camera.tiles_x,
                                                   level, camera.near_plane, part, parts},
                              buffers, camera.tiles_x, camera.tiles_y, kBlocksOfTile);
    };
    walk(bracket_pass_, segments);
    if (longest_list <= LIST_SEGMENT) walk(search_, 1);
    buffers.emplace_back(product_);
    for (std::uint32_t w = 0; w < kWalks; ++w) walk(walk_, segments);
}

PointLight::PointLight(Device& device, const ForwardOptions& options, DepthReading reading)
    : device_(&device), planes_(device, options) {
    SpecConstants constants = ray_constants(device, options, reading);
    const std::uint32_t subgroup = blend_subgroup(device);
    const std::uint32_t rays = std::min(kBlockPixels / subgroup, kMostRays);
    points_of_item_ = subgroup * rays;
    constants["PIXELS"] = static_cast<std::int32_t>(rays);
    constants["SAMPLES"] = 1;
    pass_ = Pipeline(device, "light_at_points", constants, true, subgroup);
}

std::vector<float> PointLight::find(Commands& commands, const GpuSplats& splats,
                                    const FrameView& view, const Frame& frame,
                                    std::uint32_t longest_list, std::span<const ViewPoint> points) {
    if (points.empty()) return {};
    const SortedPoints sorted = sorted_by_block(points, view.camera, points_of_item_);
    hold(*device_, points_, "points of a view", points.size() * sizeof(ViewPoint));
    hold(*device_, items_, "blocks of points", sorted.items.size() * sizeof(glm::uvec4));
    hold(*device_, light_, "light at points", points.size() * sizeof(float));
    points_.upload(sorted.points);
    items_.upload(sorted.items);
    const auto items = static_cast<std::uint32_t>(sorted.items.size());
    const std::uint32_t segments = segments_of(longest_list);
    const ProjectedSplats& s = frame.splats;
    const TileIntersections& t = frame.intersections;
    const Groups g = groups_for(items, 1);
    commands.begin();
    planes_.record(commands, splats, view, frame);
    commands.pass("light at points");
    for (std::uint32_t segment = 0; segment < segments; ++segment)
        commands.dispatch(
            pass_, gpu::PointLightArgs{items, segment},
            {t.tile_range, t.intersection_from_sorted, t.splat_from_intersection, s.shape, s.light,
             s.bound, s.exponent, planes_.planes(), points_, items_, light_},
            g.x, g.y);
    commands.submit_and_wait();
    std::vector<float> light(points.size());
    const std::vector<float> found = light_.download<float>(points.size());
    for (std::size_t i = 0; i < found.size(); ++i) light[sorted.from[i]] = found[i];
    return light;
}

}  // namespace darb
