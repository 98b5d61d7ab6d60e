// SPDX-License-Identifier: MIT
#include "engine/raster/median_depth.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/core/error.h"
#include "engine/kernels/kernel_family.h"
#include "engine/primitives/groups.h"
#include "engine/raster/forward.h"

namespace darb {

namespace {

constexpr std::uint32_t kBlocksOfTile = 4, kBlockThreads = 64;

std::uint64_t pixel_bytes(std::uint32_t segments) {
    const std::uint64_t products = segments > 1 ? MEDIAN_SAMPLES * sizeof(float) : 0;
    return sizeof(glm::vec4) + sizeof(glm::uvec3) + products + sizeof(glm::vec2);
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

MedianDepth::MedianDepth(Device& device, const ForwardOptions& options, DepthReading reading)
    : device_(&device) {
    DARB_CHECK(reading != DepthReading::expected);
    if (kernel_pulses(options.kernel) > 1 && reading != DepthReading::plane)
        throw Error("depth",
                    fmt::format("the kernel {} rises again beyond its first pulse, so that the "
                                "light along a ray has no single middle",
                                kernel_name(options.kernel)),
                    "Read the depth as `plane` or `expected`.");
    SpecConstants shared = kernel_constants(device, options);
    SpecConstants plane = shared;
    add_constants(options.effects, plane);
    plane = for_several_passes(std::move(plane));
    plane["THREADS"] = SPLAT_GROUP;
    plane_ = Pipeline(device, "depth_plane", plane);
    shared["THREADS"] = static_cast<std::int32_t>(kBlockThreads);
    shared["READING"] = static_cast<std::int32_t>(reading);
    shared["MIN_TRANSMITTANCE"] = least_transmittance(options.transmittance_stop);
    shared["BRACKET"] = 1;
    bracket_pass_ = Pipeline(device, "median_depth", shared);
    shared["BRACKET"] = 0;
    walk_ = Pipeline(device, "median_depth", shared);
}

std::uint64_t MedianDepth::device_bytes(std::uint32_t splats, std::uint64_t pixels) {
    return splats * sizeof(glm::vec3) + pixels * pixel_bytes(1);
}

void MedianDepth::reserve(std::uint32_t splats, std::uint64_t pixels, std::uint32_t segments) {
    const auto hold = [&](Buffer& buffer, const char* name, std::uint64_t bytes) {
        if (buffer && buffer.bytes() >= bytes) return;
        buffer = Buffer();  // never an old and a new one at a time
        buffer = Buffer(*device_, name, bytes, Memory::device, "median depth");
    };
    hold(planes_, "splat planes", splats * sizeof(glm::vec3));
    hold(bracket_, "depth brackets", pixels * sizeof(glm::vec4));
    hold(part_, "parts of lists", pixels * sizeof(glm::uvec3));
    hold(product_, "light at depths", segments > 1 ? pixels * MEDIAN_SAMPLES * sizeof(float) : 4);
    hold(depth_, "median depth", pixels * sizeof(glm::vec2));
}

void MedianDepth::record(Commands& commands, const GpuSplats& splats, const FrameView& view,
                         const Frame& frame, std::uint32_t longest_list, float level) {
    DARB_CHECK(level > 0 && level < 1, "level = {}", level);
    const gpu::CameraData& camera = view.camera;
    const std::uint32_t segments =
        std::max(1u, (longest_list + MEDIAN_SEGMENT - 1) / MEDIAN_SEGMENT);
    reserve(splats.count(), std::uint64_t(camera.width) * camera.height, segments);
    const ProjectedSplats& s = frame.splats;
    const TileIntersections& t = frame.intersections;
    commands.pass("depth planes");
    if (splats.count() > 0) {
        const Groups g = groups_for(splats.count());
        commands.dispatch(
            plane_,
            gpu::DepthPlaneArgs{splats.count(), view.index, static_cast<float>(LOW_PASS_DEFAULT)},
            {*view.cameras, splats.parameters(kPosition), splats.parameters(kLogScale),
             splats.parameters(kRotation), splats.parameters(kShape), splats.smoothing(), s.visible,
             planes_},
            g.x, g.y);
    }
    commands.pass("median depth");
    const auto walk = [&](const Pipeline& pipeline) {
        for (std::uint32_t segment = 0; segment < segments; ++segment)
            commands.dispatch(
                pipeline,
                gpu::MedianDepthArgs{camera.width, camera.height, camera.tiles_x, level,
                                     camera.near_plane, segment, segments},
                {t.tile_range, t.intersection_from_sorted, t.splat_from_intersection, s.shape,
                 s.light, s.bound, s.exponent, planes_, bracket_, part_, product_, depth_},
                camera.tiles_x, camera.tiles_y, kBlocksOfTile);
    };
    walk(bracket_pass_);
    for (std::uint32_t w = 0; w < MEDIAN_WALKS; ++w) walk(walk_);
}

}  // namespace darb
