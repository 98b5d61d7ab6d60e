// The cells of a scene that is trained in blocks: rectangles on the ground plane that together
// cover all of it, with about as many points in each.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "engine/data/dataset.h"

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

/// Of the middle nine tenths of a cell's points, the share of their width that a margin takes.
constexpr double kMarginShare = 0.15;

struct Partition {
    GroundPlane plane;
    int columns = 1, rows = 1;
    std::vector<Cell> cells;  // [columns][rows]

    /// The one cell that a place lies in.
    std::size_t cell_of(const glm::dvec3& world) const;
    /// Of kRounds, the one in which a cell has its turn: cells of a round touch in corners at most.
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

/// At least `blocks` cells, as few as a grid of this kind allows, whose columns and rows are to
/// each other about as the widths of the ground.
struct Grid {
    int columns = 1, rows = 1;
};
Grid grid_for(int blocks, const GroundPlane& plane, std::span<const double> points);

}  // namespace darb
