// SPDX-License-Identifier: MIT
// The cells of a scene that is trained in blocks: rectangles on the ground plane that together
// cover all of it, with about as many points in each.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/raster/forward_options.h"
#include "engine/scene/splat_model.h"
#include "trainer/options/options.h"

namespace darb {

/// Two level axes, of length 1, with up at right angles to both.
struct GroundPlane {
    glm::dvec3 up{0, -1, 0}, u{1, 0, 0}, v{0, 0, 1};
    glm::dvec2 at(const glm::dvec3& world) const {
        return {glm::dot(world, u), glm::dot(world, v)};
    }
};

/// Up is what the pictures' rows are at right angles to, whichever way the cameras look down: the
/// direction that their right axes have least of. u is the level axis along which the points,
/// [P][3] world, are spread more widely.
GroundPlane ground_plane(const std::vector<View>& views, std::span<const double> points);

/// Rectangle on the ground: low <= p < high. The outer sides of outer cells are infinite.
struct Cell {
    glm::dvec2 low{0}, high{0};
    glm::dvec2 margin{0};  // on each side, world units; how far beyond it the block is trained
    bool holds(const glm::dvec2& p) const {
        return p.x >= low.x && p.x < high.x && p.y >= low.y && p.y < high.y;
    }
    bool holds_with_margin(const glm::dvec2& p) const {
        return Cell{low - margin, high + margin}.holds(p);
    }
};

/// Width of a margin, as a share of the width that the middle nine tenths of a cell's points take.
constexpr double kMarginShare = 0.15;

struct Partition {
    GroundPlane plane;
    int columns = 1, rows = 1;
    std::vector<Cell> cells;  // [columns][rows]

    /// The one cell that a place lies in.
    std::size_t cell_of(const glm::dvec3& world) const;
    /// Which of the kRounds rounds trains a cell: cells of one round touch at corners at most.
    int round_of(std::size_t cell) const {
        const auto in_column = static_cast<std::size_t>(rows);
        return static_cast<int>(cell / in_column % 2 * 2 + cell % in_column % 2);
    }
    static constexpr int kRounds = 4;
};

/// `columns` strips across u with as many points each, and each strip in `rows` cells with as many.
/// Throws Error where there are too few places for so many cells.
Partition partition(const GroundPlane& plane, std::span<const double> points, int columns,
                    int rows);

/// How many of the points [P][3] lie in each cell, and in each with its margin.
struct CellCount {
    std::size_t own = 0, with_margin = 0;
};
std::vector<CellCount> count_points(const Partition& cells, std::span<const double> points);

/// The grid with at least `blocks` cells, as few as possible, whose numbers of columns and rows are
/// about in the ratio of the ground's widths.
struct Grid {
    int columns = 1, rows = 1;
};
Grid grid_for(int blocks, const GroundPlane& plane, std::span<const double> points);

// Which cameras a block is trained on: those in whose pictures the splats of its cell, in the
// coarse model of the whole, make up enough.

/// Share of a picture from which on its camera sees enough of a cell.
constexpr double kLeastShare = 0.05;
/// A cell that fewer cameras see enough of gets those that see most of it.
constexpr std::size_t kFewestViews = 3;

/// [view][cell]: the mean over the picture of sum alpha T over the splats of the cell, which is
/// what they contribute. Three cells a picture: their splats are drawn red, green and blue, the
/// others black.
std::vector<std::vector<double>> cell_shares(Device& device, const SplatModel& coarse,
                                             const Partition& cells, const std::vector<View>& views,
                                             const ProjectionEffects& effects);

/// [cell]: the views, ascending, that show at least `least` of it or more of it than of any other
/// cell. A cell has fewer than kFewestViews only where fewer show any of it.
std::vector<std::vector<std::size_t>> choose_views(const std::vector<std::vector<double>>& shares,
                                                   double least = kLeastShare);

// What the parts of a run in blocks are trained with.

/// How many splats all blocks together may have: options.max_splats, or the forecast for a run of
/// the whole scene.
std::uint32_t whole_splats(const Dataset& dataset, const TrainOptions& options);
/// How many splats the coarse model has when the whole may have so many.
std::uint32_t coarse_splats(std::uint32_t whole);
/// Options of the coarse model: half the iterations, no view-dependent colour, an eighth of the
/// splats.
TrainOptions coarse_options(const Dataset& dataset, const TrainOptions& options);
/// Options of a block: the colours' degree follows the iteration, without a probe. Besides the
/// frozen splats it may have its share of options.max_splats, by the points in the cell with its
/// margin, but at least `start`, which it begins with.
TrainOptions block_options(const TrainOptions& options, const CellCount& count, std::size_t points,
                           std::uint32_t frozen, std::uint32_t start);

}  // namespace darb
