// SPDX-License-Identifier: MIT
#include "engine/mesh/depth_views.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/core/error.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/pipeline.h"
#include "engine/primitives/groups.h"
#include "engine/raster/frame_view.h"

namespace darb {

namespace {

std::uint64_t pixels_of(const DepthView& view) {
    return view.depth.size();
}

std::uint32_t packed_colour(const float* rgb) {
    std::uint32_t word = 0xFF000000u;
    for (unsigned c = 0; c < 3; ++c) {
        const float byte = std::clamp(rgb[c], 0.0f, 1.0f) * 255.0f + 0.5f;
        word |= static_cast<std::uint32_t>(byte) << (8 * c);
    }
    return word;
}

// A few pixels of a view as points in the world.
std::vector<glm::dvec3> sampled_points(const DepthView& view) {
    constexpr int kAcross = 16, kDown = 12;
    const Camera& c = view.camera;
    std::vector<glm::dvec3> points;
    for (int j = 0; j < kDown; ++j)
        for (int i = 0; i < kAcross; ++i) {
            const int x = (2 * i + 1) * c.width / (2 * kAcross);
            const int y = (2 * j + 1) * c.height / (2 * kDown);
            const double z = view.depth[std::size_t(y) * c.width + x];
            if (!(z > 0)) continue;
            const glm::dvec3 in_camera((x + 0.5 - c.cx) / c.fx * z, (y + 0.5 - c.cy) / c.fy * z, z);
            points.push_back(glm::transpose(c.rotation) * (in_camera - c.translation));
        }
    return points;
}

// How much another view says of the points: each counts by the angle between the two rays.
double overlap(const std::vector<glm::dvec3>& points, const Camera& from, const DepthView& other) {
    constexpr double kGoodAngle = 12, kWidest = 60, kHidden = 0.9;
    const Camera& c = other.camera;
    double sum = 0;
    for (const glm::dvec3& p : points) {
        const glm::dvec3 q = c.rotation * p + c.translation;
        const double x = c.fx * q.x / q.z + c.cx, y = c.fy * q.y / q.z + c.cy;
        if (!(q.z > 0) || x < 0 || y < 0 || x >= c.width || y >= c.height) continue;
        const double there = other.depth[std::size_t(y) * c.width + std::size_t(x)];
        if (!(there > kHidden * q.z)) continue;
        const glm::dvec3 a = glm::normalize(p - from.centre()), b = glm::normalize(p - c.centre());
        const double angle = glm::degrees(std::acos(std::clamp(glm::dot(a, b), -1.0, 1.0)));
        sum += angle < kGoodAngle ? angle / kGoodAngle
                                  : std::max(1 - (angle - kGoodAngle) / kWidest, 0.01);
    }
    return sum;
}

}  // namespace

std::vector<DepthView> render_depth_views(Renderer& renderer, const std::vector<Camera>& cameras,
                                          const DepthViewOptions& options,
                                          const MeshProgress& progress) {
    std::vector<DepthView> views;
    for (const Camera& camera : cameras) {
        if (progress) progress("depths", double(views.size()) / double(cameras.size()));
        DepthView view;
        view.camera = camera;
        view.camera.lens = {};
        view.camera.shutter = {};
        const ImageF picture = renderer.render(view.camera, glm::vec3(0.0f),
                                               options.colours ? -1 : 0, options.near_plane);
        if (options.colours)
            for (std::size_t p = 0; p < picture.data.size(); p += 3)
                view.colour.push_back(packed_colour(&picture.data[p]));
        const ImageF depth = renderer.render_depth(options.reading, options.level);
        view.depth.resize(depth.data.size() / 2);
        for (std::size_t p = 0; p < view.depth.size(); ++p) {
            const bool opaque = depth.data[2 * p + 1] >= 1 - options.level;
            view.depth[p] = opaque ? depth.data[2 * p] : 0.0f;
        }
        views.push_back(std::move(view));
    }
    return views;
}

std::vector<std::vector<std::size_t>> views_to_agree(const std::vector<DepthView>& views) {
    std::vector<std::vector<std::size_t>> chosen(views.size());
    for (std::size_t v = 0; v < views.size(); ++v) {
        const std::vector<glm::dvec3> points = sampled_points(views[v]);
        std::vector<std::pair<double, std::size_t>> scores;
        for (std::size_t o = 0; o < views.size(); ++o) {
            const double score = o == v ? 0 : overlap(points, views[v].camera, views[o]);
            if (score > 0) scores.emplace_back(-score, o);
        }
        std::ranges::sort(scores);
        for (std::size_t k = 0; k < std::min<std::size_t>(scores.size(), AGREE_VIEWS); ++k)
            chosen[v].push_back(scores[k].second);
    }
    return chosen;
}

ConfirmedDepths keep_confirmed(Device& device, std::vector<DepthView>& views,
                               const glm::dvec3& origin, const MeshProgress& progress) {
    const auto others = views_to_agree(views);
    std::uint64_t most = 0;
    for (const DepthView& view : views) most = std::max(most, pixels_of(view));
    const Pipeline agree(device, "depth_agree",
                         {{"THREADS", static_cast<std::int32_t>(MESH_GROUP)}});
    ViewBatch batch(device, views, origin, most * (AGREE_VIEWS + 1), false);
    const Buffer kept(device, "confirmed depths", most * sizeof(float), Memory::device, "agree");
    Commands commands(device);
    std::vector<std::vector<float>> confirmed(views.size());
    ConfirmedDepths counts;
    for (std::size_t v = 0; v < views.size(); ++v) {
        if (progress) progress("agreement", double(v) / double(views.size()));
        std::vector<std::size_t> chosen{v};
        chosen.insert(chosen.end(), others[v].begin(), others[v].end());
        batch.load(chosen);
        const Groups g = groups_for(pixels_of(views[v]), MESH_GROUP);
        commands.begin();
        commands.pass("agree");
        commands.dispatch(agree, gpu::AgreeArgs{static_cast<std::uint32_t>(others[v].size()), 2},
                          {batch.views(), batch.depths(), kept}, g.x, g.y);
        commands.submit_and_wait();
        confirmed[v] = kept.download<float>(pixels_of(views[v]));
        const auto there = [](float z) { return z > 0; };
        counts.pixels += pixels_of(views[v]);
        counts.surfaces += static_cast<std::size_t>(std::ranges::count_if(views[v].depth, there));
        counts.kept += static_cast<std::size_t>(std::ranges::count_if(confirmed[v], there));
    }
    for (std::size_t v = 0; v < views.size(); ++v) views[v].depth = std::move(confirmed[v]);
    return counts;
}

ViewBatch::ViewBatch(Device& device, const std::vector<DepthView>& views, const glm::dvec3& origin,
                     std::uint64_t pixels, bool colours)
    : views_(&views), origin_(origin), pixels_(pixels) {
    for (const DepthView& view : views) pixels_ = std::max(pixels_, pixels_of(view));
    view_buffer_ = Buffer(device, "mesh views", views.size() * sizeof(gpu::MeshView));
    depths_ = Buffer(device, "depths of views", pixels_ * sizeof(float), Memory::device, "mesh");
    colours_ = Buffer(device, "colours of views", colours ? pixels_ * sizeof(std::uint32_t) : 4,
                      Memory::device, "mesh");
}

std::uint64_t ViewBatch::device_bytes(std::uint64_t pixels, std::size_t views, bool colours) {
    return pixels * (colours ? 8 : 4) + views * sizeof(gpu::MeshView);
}

std::size_t ViewBatch::load(std::size_t first) {
    std::vector<std::size_t> chosen;
    std::uint64_t pixels = 0;
    for (std::size_t v = first; v < views_->size(); ++v) {
        pixels += pixels_of((*views_)[v]);
        if (pixels > pixels_) break;
        chosen.push_back(v);
    }
    load(chosen);
    return first + chosen.size();
}

void ViewBatch::load(const std::vector<std::size_t>& chosen) {
    std::vector<gpu::MeshView> records;
    std::uint64_t first = 0;
    for (const std::size_t v : chosen) {
        const DepthView& view = (*views_)[v];
        DARB_CHECK(first + pixels_of(view) <= pixels_, "pixel {} of {}", first, pixels_);
        records.push_back({camera_data(view.camera, origin_), static_cast<std::uint32_t>(first)});
        depths_.upload(view.depth, first * sizeof(float));
        if (colours_.bytes() > 4) colours_.upload(view.colour, first * sizeof(std::uint32_t));
        first += pixels_of(view);
    }
    view_buffer_.upload(records);
}

}  // namespace darb
