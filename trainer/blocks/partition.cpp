// SPDX-License-Identifier: MIT
#include "trainer/blocks/partition.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/core/error.h"
#include "engine/render/renderer.h"
#include "engine/scene/edit_splats.h"

namespace darb {

namespace {

constexpr double kNoLimitOfCell = std::numeric_limits<double>::infinity();
constexpr int kPowerSteps = 500;
constexpr double kWidthTail = 0.05;  // share of the points at each end that a width ignores

glm::dvec3 point_at(std::span<const double> points, std::size_t p) {
    return {points[3 * p], points[3 * p + 1], points[3 * p + 2]};
}

// The eigenvector of the least eigenvalue of sum r r^T over the right axes r: power iteration on
// trace - that. It begins with what is up in level and in tilted pictures, which also decides where
// all cameras have one heading, and which of the two ends is up.
glm::dvec3 up_of_cameras(const std::vector<View>& views) {
    glm::dmat3 rights(0);
    glm::dvec3 up(0);
    for (const View& view : views) {
        const glm::dmat3 axes = glm::transpose(view.camera.rotation);
        rights += glm::outerProduct(axes[0], axes[0]);
        up -= axes[1] + 0.5 * axes[2];
    }
    if (!(glm::length(up) > 1e-3 * static_cast<double>(views.size()))) return {0, -1, 0};
    const glm::dmat3 flipped = glm::dmat3(rights[0][0] + rights[1][1] + rights[2][2]) - rights;
    for (int step = 0; step < kPowerSteps; ++step) up = glm::normalize(flipped * up);
    return up;
}

double width_quantile(const std::vector<double>& sorted, double share) {
    return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
}

double width_of(std::vector<double> values) {
    if (values.size() < 2) return 0;
    std::sort(values.begin(), values.end());
    return width_quantile(values, 1 - kWidthTail) - width_quantile(values, kWidthTail);
}

glm::dvec2 widths(const GroundPlane& plane, std::span<const double> points) {
    std::vector<double> u, v;
    for (std::size_t p = 0; p < points.size() / 3; ++p) {
        const glm::dvec2 at = plane.at(point_at(points, p));
        u.push_back(at.x);
        v.push_back(at.y);
    }
    return {width_of(std::move(u)), width_of(std::move(v))};
}

// `pieces` + 1 limits with as many of the values between each two, the outer ones infinite; empty
// where too few values differ.
std::vector<double> cuts(std::vector<double> values, int pieces) {
    std::sort(values.begin(), values.end());
    std::vector<double> limits{-kNoLimitOfCell};
    for (int k = 1; k < pieces; ++k) {
        const std::size_t at = values.size() * static_cast<std::size_t>(k) / std::size_t(pieces);
        if (at == 0) return {};
        const double cut = (values[at - 1] + values[at]) / 2;
        if (!(cut > limits.back()) || !(cut > values.front())) return {};
        limits.push_back(cut);
    }
    limits.push_back(kNoLimitOfCell);
    return limits;
}

[[noreturn]] void refuse_cells(int columns, int rows, std::size_t points) {
    throw Error(fmt::format("--blocks {}x{}", columns, rows),
                fmt::format("{} points lie in too few places for so many cells", points),
                "Use fewer blocks.");
}

}  // namespace

GroundPlane ground_plane(const std::vector<View>& views, std::span<const double> points) {
    GroundPlane plane;
    plane.up = up_of_cameras(views);
    int least = 0;  // the axis of the world that is most nearly level
    for (int a = 1; a < 3; ++a)
        if (std::abs(plane.up[a]) < std::abs(plane.up[least])) least = a;
    glm::dvec3 axis(0);
    axis[least] = 1;
    plane.u = glm::normalize(axis - glm::dot(axis, plane.up) * plane.up);
    plane.v = glm::cross(plane.up, plane.u);
    const glm::dvec2 width = widths(plane, points);
    if (width.y > width.x) std::swap(plane.u, plane.v);
    return plane;
}

std::size_t Partition::cell_of(const glm::dvec3& world) const {
    const glm::dvec2 at = plane.at(world);
    for (std::size_t c = 0; c < cells.size(); ++c)
        if (cells[c].holds(at)) return c;
    DARB_CHECK(false, "no cell at {} {}", at.x, at.y);
}

Partition partition(const GroundPlane& plane, std::span<const double> points, int columns,
                    int rows) {
    const std::size_t count = points.size() / 3;
    std::vector<glm::dvec2> at;
    std::vector<double> u;
    for (std::size_t p = 0; p < count; ++p) {
        at.push_back(plane.at(point_at(points, p)));
        u.push_back(at.back().x);
    }
    Partition result{plane, columns, rows, {}};
    const std::vector<double> across = cuts(std::move(u), columns);
    if (across.empty()) refuse_cells(columns, rows, count);
    for (std::size_t c = 0; c + 1 < across.size(); ++c) {
        std::vector<double> v;
        for (const glm::dvec2& p : at)
            if (p.x >= across[c] && p.x < across[c + 1]) v.push_back(p.y);
        const std::vector<double> along = cuts(std::move(v), rows);
        if (along.empty()) refuse_cells(columns, rows, count);
        for (std::size_t r = 0; r + 1 < along.size(); ++r)
            result.cells.push_back({{across[c], along[r]}, {across[c + 1], along[r + 1]}, {}});
    }
    for (Cell& cell : result.cells) {
        std::vector<double> x, y;
        for (const glm::dvec2& p : at)
            if (cell.holds(p)) x.push_back(p.x), y.push_back(p.y);
        if (x.empty()) refuse_cells(columns, rows, count);
        cell.margin = kMarginShare * glm::dvec2(width_of(std::move(x)), width_of(std::move(y)));
    }
    return result;
}

std::vector<CellCount> count_points(const Partition& cells, std::span<const double> points) {
    std::vector<CellCount> counts(cells.cells.size());
    for (std::size_t p = 0; p < points.size() / 3; ++p) {
        const glm::dvec2 at = cells.plane.at(point_at(points, p));
        for (std::size_t c = 0; c < counts.size(); ++c) {
            counts[c].own += cells.cells[c].holds(at) ? 1 : 0;
            counts[c].with_margin += cells.cells[c].holds_with_margin(at) ? 1 : 0;
        }
    }
    return counts;
}

Grid grid_for(int blocks, const GroundPlane& plane, std::span<const double> points) {
    const glm::dvec2 width = widths(plane, points);
    const double wanted = std::log(std::max(width.x, 1e-9) / std::max(width.y, 1e-9));
    Grid best;
    double best_cost = kNoLimitOfCell;
    for (int columns = 1; columns <= blocks; ++columns) {
        const int rows = (blocks + columns - 1) / columns;
        // A cell too many costs as much as sides that are out of proportion by so much.
        const double cost = std::abs(std::log(double(columns) / rows) - wanted) +
                            double(columns * rows - blocks) / blocks * 4;
        if (cost < best_cost) best = {columns, rows}, best_cost = cost;
    }
    return best;
}

namespace {

constexpr std::size_t kChannels = 3;
constexpr float kFull = static_cast<float>(0.5 / SH_C0);  // sh_dc of a channel at 1; less it, at 0

// The means of the channels of a picture.
std::array<double, kChannels> picture_means(const ImageF& picture) {
    std::array<double, kChannels> sum{};
    for (std::size_t i = 0; i < picture.data.size(); ++i) sum[i % kChannels] += picture.data[i];
    const std::size_t pixels = picture.data.size() / kChannels;
    for (double& s : sum) s /= static_cast<double>(pixels);
    return sum;
}

// Those that see most of it, kFewestViews at most; in order.
std::vector<std::size_t> best_views(const std::vector<std::vector<double>>& shares,
                                    std::size_t cell) {
    std::vector<std::size_t> best;
    for (std::size_t v = 0; v < shares.size(); ++v)
        if (shares[v][cell] > 0) best.push_back(v);
    std::stable_sort(best.begin(), best.end(), [&](std::size_t a, std::size_t b) {
        return shares[a][cell] > shares[b][cell];
    });
    best.resize(std::min(best.size(), kFewestViews));
    std::sort(best.begin(), best.end());
    return best;
}

}  // namespace

std::vector<std::vector<double>> cell_shares(Device& device, const SplatModel& coarse,
                                             const Partition& cells, const std::vector<View>& views,
                                             const ProjectionEffects& effects) {
    std::vector<std::vector<double>> shares(views.size());
    std::vector<std::size_t> cell(coarse.size());
    for (std::size_t i = 0; i < coarse.size(); ++i) cell[i] = cells.cell_of(position_of(coarse, i));
    SplatModel marked = coarse;
    limit_sh_degree(0, marked);
    for (std::size_t first = 0; first < cells.cells.size(); first += kChannels) {
        for (std::size_t i = 0; i < marked.size(); ++i)
            for (std::size_t c = 0; c < kChannels; ++c)
                marked.sh_dc[kChannels * i + c] = cell[i] == first + c ? kFull : -kFull;
        Renderer renderer(device, marked, Accuracy{}, effects);
        const std::size_t shown = std::min(kChannels, cells.cells.size() - first);
        for (std::size_t v = 0; v < views.size(); ++v) {
            const auto means = picture_means(renderer.render(views[v].camera));
            shares[v].insert(shares[v].end(), means.begin(), means.begin() + std::ptrdiff_t(shown));
        }
    }
    return shares;
}

std::vector<std::vector<std::size_t>> choose_views(const std::vector<std::vector<double>>& shares,
                                                   double least) {
    std::vector<std::vector<std::size_t>> chosen(shares.empty() ? 0 : shares.front().size());
    for (std::size_t v = 0; v < shares.size(); ++v) {
        const std::vector<double>& of = shares[v];
        const auto most = std::size_t(std::max_element(of.begin(), of.end()) - of.begin());
        for (std::size_t c = 0; c < of.size(); ++c)
            if (of[c] >= least || (c == most && of[c] > 0)) chosen[c].push_back(v);
    }
    for (std::size_t c = 0; c < chosen.size(); ++c)
        if (chosen[c].size() < kFewestViews) chosen[c] = best_views(shares, c);
    return chosen;
}

}  // namespace darb
