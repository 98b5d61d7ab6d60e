// SPDX-License-Identifier: MIT
#include "engine/mesh/opacity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/core/error.h"

namespace darb {

namespace {

constexpr float kUnseen = -1;
// A round asks for the points that cut what is left of an edge into so many parts.
constexpr int kParts = 4, kRounds = 3;
// Device memory of a point: its place, its light, and at most an item of its own.
constexpr std::uint64_t kBytesOfPoint = 12 + 4 + 16;
constexpr std::size_t kMostAtATime = 4'000'000;  // a binding of 128 MiB holds as many

/// What is left of an edge that the surface cuts: shares of it, the free end first, and the light
/// there.
struct CutEdge {
    float free = 0, solid = 1;
    float free_light = 1, solid_light = 0;
};

std::vector<glm::vec3> points_on(std::span<const VoxelEdge> edges,
                                 const std::vector<std::array<float, kParts - 1>>& shares) {
    std::vector<glm::vec3> points;
    points.reserve(edges.size() * (kParts - 1));
    for (std::size_t e = 0; e < edges.size(); ++e)
        for (const float share : shares[e])
            points.push_back(edges[e].from + share * (edges[e].to - edges[e].from));
    return points;
}

/// The light at both ends says which is free. Both are asked as the voxels were, so that they
/// differ.
std::vector<CutEdge> ends_of(OpacityField& field, std::span<const VoxelEdge> edges) {
    std::vector<glm::vec3> points;
    for (const VoxelEdge& edge : edges) {
        points.push_back(edge.from);
        points.push_back(edge.to);
    }
    const std::vector<float> light = field.light(points, 1);
    std::vector<CutEdge> cut(edges.size());
    for (std::size_t e = 0; e < edges.size(); ++e) {
        const float from = light[2 * e], to = light[2 * e + 1];
        cut[e] = from > to ? CutEdge{0, 1, from, to} : CutEdge{1, 0, to, from};
    }
    return cut;
}

/// Keeps the part of each edge, from its free end on, in which the light first falls to the level.
void narrow(OpacityField& field, std::span<const VoxelEdge> edges, std::vector<CutEdge>& cut) {
    std::vector<std::array<float, kParts - 1>> shares(edges.size());
    for (std::size_t e = 0; e < edges.size(); ++e)
        for (int i = 1; i < kParts; ++i)
            shares[e][i - 1] = cut[e].free + (cut[e].solid - cut[e].free) * float(i) / kParts;
    const std::vector<float> light = field.light(points_on(edges, shares), 1);
    for (std::size_t e = 0; e < edges.size(); ++e)
        for (int i = 0; i < kParts - 1; ++i) {
            const float there = light[e * (kParts - 1) + std::size_t(i)];
            if (there < field.level()) {
                cut[e].solid = shares[e][i];
                cut[e].solid_light = there;
                break;
            }
            cut[e].free = shares[e][i];
            cut[e].free_light = there;
        }
}

glm::vec3 place_on(const VoxelEdge& edge, const CutEdge& cut, float level) {
    const float fall = cut.free_light - std::max(cut.solid_light, 0.0f);
    const float part = fall > 0 ? std::clamp((cut.free_light - level) / fall, 0.0f, 1.0f) : 0.5f;
    return edge.from + (cut.free + part * (cut.solid - cut.free)) * (edge.to - edge.from);
}

}  // namespace

OpacityField::OpacityField(Renderer& renderer, const std::vector<DepthView>& views,
                           const glm::dvec3& origin, const DepthViewOptions& options,
                           std::uint64_t working_bytes)
    : renderer_(&renderer),
      origin_(origin),
      options_(options),
      points_at_a_time_(
          std::clamp<std::size_t>(working_bytes / kBytesOfPoint, 4096, kMostAtATime)) {
    DARB_CHECK(options.reading != DepthReading::expected);
    for (const DepthView& view : views) cameras_.push_back(view.camera);
}

std::vector<float> OpacityField::light(std::span<const glm::vec3> points, float enough,
                                       const MeshProgress& progress) {
    std::vector<float> most(points.size(), kUnseen);
    std::vector<ViewPoint> asked;
    std::vector<std::size_t> which;
    for (std::size_t v = 0; v < cameras_.size(); ++v) {
        if (progress) progress("opacity", double(v) / double(cameras_.size()));
        const Camera& c = cameras_[v];
        bool listed = false;
        const auto ask = [&] {
            if (asked.empty()) return;
            if (!listed) renderer_->list(c, options_.near_plane);
            listed = true;
            const std::vector<float> left = renderer_->light_at(asked, options_.reading);
            for (std::size_t i = 0; i < left.size(); ++i)
                most[which[i]] = std::max(most[which[i]], left[i]);
            asked.clear();
            which.clear();
        };
        const glm::dvec3 shift = c.rotation * origin_ + c.translation;
        for (std::size_t i = 0; i < points.size(); ++i) {
            if (most[i] > enough) continue;
            const glm::dvec3 q = c.rotation * glm::dvec3(points[i]) + shift;
            if (!(q.z > options_.near_plane)) continue;
            const double x = c.fx * q.x / q.z + c.cx, y = c.fy * q.y / q.z + c.cy;
            if (!(x >= 0 && y >= 0 && x < c.width && y < c.height)) continue;
            asked.push_back(
                {static_cast<float>(x), static_cast<float>(y), static_cast<float>(q.z)});
            which.push_back(i);
            if (asked.size() == points_at_a_time_) ask();
        }
        ask();
    }
    return most;
}

TriangleMesh opacity_surface(Device& device, OpacityField& field,
                             const std::vector<DepthView>& views, const glm::dvec3& origin,
                             const TsdfOptions& options, TsdfReport& report,
                             const MeshProgress& progress) {
    const SurfaceField surface{
        [&](std::span<const glm::vec3> points) {
            std::vector<float> values = field.light(points, field.level(), progress);
            for (float& value : values)
                value = value == kUnseen ? std::numeric_limits<float>::quiet_NaN()
                                         : value - field.level();
            return values;
        },
        [&](std::span<const VoxelEdge> edges, std::vector<glm::vec3>& position) {
            if (progress) progress("refinement", 0);
            std::vector<CutEdge> cut = ends_of(field, edges);
            for (int round = 0; round < kRounds; ++round) {
                narrow(field, edges, cut);
                if (progress) progress("refinement", double(round + 1) / kRounds);
            }
            for (std::size_t e = 0; e < edges.size(); ++e)
                position[e] = place_on(edges[e], cut[e], field.level());
        }};
    return fuse_depths(device, views, origin, options, report, progress, &surface);
}

}  // namespace darb
