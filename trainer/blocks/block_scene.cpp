// SPDX-License-Identifier: MIT
#include "trainer/blocks/block_scene.h"

#include <algorithm>
#include <cmath>

#include "engine/core/error.h"
#include "engine/raster/gpu_splats.h"
#include "engine/scene/edit_splats.h"
#include "trainer/growth/initial_model.h"

namespace darb {

namespace {

// In half widths and heights of the picture, to each side: a splat beyond the edge may reach into
// it.
constexpr double kBesidePicture = 1.3;
constexpr double kDeviations = 3;

// Bands up to `degree`, those that are not there yet 0.
void widen_sh(int degree, SplatModel& model) {
    limit_sh_degree(degree, model);
    const std::size_t before = attribute_floats(kShRest, model.sh_degree);
    const std::size_t after = attribute_floats(kShRest, degree);
    std::vector<float> rest(model.size() * after, 0.0f);
    for (std::size_t i = 0; i < model.size(); ++i)
        std::copy_n(model.sh_rest.begin() + std::ptrdiff_t(i * before), before,
                    rest.begin() + std::ptrdiff_t(i * after));
    model.sh_degree = degree;
    model.sh_rest = std::move(rest);
}

// A pinhole's frame with room beside it; with a lens, which may see more than such a frame, all.
bool may_see(const Camera& camera, const glm::dvec3& centre, double radius) {
    if (camera.lens.active) return true;
    const glm::dvec3 at = camera.rotation * centre + camera.translation;
    if (at.z < -radius) return false;
    const double x = kBesidePicture * camera.width / (2 * camera.fx);
    const double y = kBesidePicture * camera.height / (2 * camera.fy);
    const double off_x = std::abs(camera.cx - camera.width / 2.0) / camera.fx;
    const double off_y = std::abs(camera.cy - camera.height / 2.0) / camera.fy;
    const double depth = std::max(at.z, 0.0);
    return std::abs(at.x) <= (x + off_x) * depth + radius * (1 + x) &&
           std::abs(at.y) <= (y + off_y) * depth + radius * (1 + y);
}

}  // namespace

Dataset block_dataset(const Dataset& whole, const std::vector<std::size_t>& views) {
    Dataset block = whole;
    block.views.clear();
    for (const std::size_t v : views) block.views.push_back(whole.views[v]);
    block.points.seen_begin.clear();  // refers to the views of the whole
    block.points.seen_by.clear();
    return block;
}

bool BlockRegion::holds(const glm::dvec3& world) const {
    return cells.cells[cell].holds_with_margin(cells.plane.at(world)) &&
           !done[cells.cell_of(world)];
}

BlockStart block_start(const SplatModel& coarse, const BlockRegion& region,
                       const SplatModel& beside, const std::vector<View>& views, int sh_degree) {
    const Partition& cells = region.cells;
    std::vector<std::uint32_t> trained, around;
    for (std::uint32_t i = 0; i < coarse.size(); ++i) {
        const glm::dvec3 centre = position_of(coarse, i);
        if (cells.cells[region.cell].holds_with_margin(cells.plane.at(centre))) {
            if (region.holds(centre)) trained.push_back(i);  // else one of `beside` stands there
            continue;
        }
        const float* scale = &coarse.log_scale[3 * std::size_t{i}];
        const double radius = kDeviations * std::exp(std::max({scale[0], scale[1], scale[2]}));
        if (std::any_of(views.begin(), views.end(),
                        [&](const View& view) { return may_see(view.camera, centre, radius); }))
            around.push_back(i);
    }
    std::stable_sort(around.begin(), around.end(), [&](std::uint32_t a, std::uint32_t b) {
        return coarse.opacity_logit[a] > coarse.opacity_logit[b];
    });
    const std::size_t spare = (around.size() + beside.size()) % GpuSplats::kFrozenUnit;
    const std::size_t spare_beside = spare - std::min(spare, around.size());
    around.resize(around.size() - (spare - spare_beside));
    std::sort(around.begin(), around.end());
    SplatModel fixed = beside;
    keep_splats([&](std::size_t i) { return i + spare_beside < beside.size(); }, fixed);
    BlockStart start;
    start.frozen = static_cast<std::uint32_t>(around.size() + fixed.size());
    start.model = pick_splats(coarse, around);
    if (fixed.size() > 0) start.model = join_parts({start.model, fixed});
    start.model = join_parts({start.model, pick_splats(coarse, trained)});
    widen_sh(sh_degree, start.model);
    return start;
}

void add_points(const Dataset& whole, const BlockRegion& region, const TrainOptions& options,
                std::uint32_t most, BlockStart& start) {
    const PointCloud& points = whole.points;
    Dataset part;
    for (std::size_t p = 0; p < points.size(); ++p) {
        const double* at = &points.position[3 * p];
        if (!region.holds({at[0], at[1], at[2]})) continue;
        part.points.position.insert(part.points.position.end(), at, at + 3);
        const std::uint8_t* colour = &points.colour[3 * p];
        part.points.colour.insert(part.points.colour.end(), colour, colour + 3);
    }
    const auto held = static_cast<std::uint32_t>(start.model.size());
    if (part.points.size() == 0 || held >= most) return;
    TrainOptions room = options;
    room.max_splats = most - held;
    SplatModel added = initial_model(part, room);
    added.antialias = start.model.antialias;
    start.model = join_parts({start.model, added});
}

SplatModel cut_to_cell(const SplatModel& trained, std::uint32_t frozen, const Partition& cells,
                       std::size_t cell) {
    SplatModel cut = trained;
    keep_splats(
        [&](std::size_t i) {
            return i >= frozen && cells.cells[cell].holds(cells.plane.at(position_of(trained, i)));
        },
        cut);
    return cut;
}

SplatModel cut_to_margin(SplatModel model, const Cell& cell, const GroundPlane& plane) {
    const SplatModel whole = model;
    keep_splats(
        [&](std::size_t i) { return cell.holds_with_margin(plane.at(position_of(whole, i))); },
        model);
    return model;
}

SplatModel join_parts(const std::vector<SplatModel>& parts) {
    DARB_CHECK(!parts.empty());
    int degree = 0;
    for (const SplatModel& part : parts) degree = std::max(degree, part.sh_degree);
    SplatModel joined = parts.front();
    std::vector<double> positions;
    for (int a = 0; a < kAttributeCount; ++a) attribute_values(joined, a).clear();
    for (SplatModel part : parts) {
        widen_sh(degree, part);
        for (std::size_t i = 0; i < part.size(); ++i)
            for (int a = 0; a < 3; ++a) positions.push_back(position_of(part, i)[a]);
        for (int a = 0; a < kAttributeCount; ++a) {
            const std::vector<float>& values = attribute_values(part, a);
            std::vector<float>& all = attribute_values(joined, a);
            all.insert(all.end(), values.begin(), values.end());
        }
    }
    joined.sh_degree = degree;
    set_positions(positions, joined);
    return joined;
}

}  // namespace darb
