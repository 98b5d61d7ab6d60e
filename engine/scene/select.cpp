// SPDX-License-Identifier: MIT
#include "engine/scene/select.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_map>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/on_threads.h"
#include "engine/scene/edit_splats.h"

namespace darb {

namespace {

constexpr double kColourOfDc = 0.28209479177387814;  // the value of the harmonic of degree 0

constexpr std::size_t kPiece = 1 << 15;  // splats for each thread

/// has: a predicate of a splat's index; must not throw.
template <class Has>
SplatSet mask_of(const SplatModel& model, const Has& has) {
    SplatSet mask(model.size());
    in_pieces(mask.size(), kPiece, [&](std::size_t first, std::size_t count) {
        for (std::size_t i = first; i < first + count; ++i) mask[i] = has(i) ? 1 : 0;
    });
    return mask;
}

/// has: a predicate of the px of a splat's centre.
template <class Has>
SplatSet on_screen(const SplatModel& model, const Camera& camera, const Has& has) {
    Camera from_origin = camera;  // its world begins at the model's origin
    from_origin.translation += camera.rotation * model.origin;
    return mask_of(model, [&](std::size_t i) {
        const float* p = &model.position[3 * i];
        const std::optional<glm::dvec2> at = pixel_of(from_origin, {p[0], p[1], p[2]});
        return at && has(*at);
    });
}

/// The edges of a closed line, sorted by the rows of the screen that they cross.
class LassoRows {
  public:
    explicit LassoRows(const std::vector<glm::dvec2>& lasso) : lasso_(lasso) {
        if (lasso.empty()) return;
        low_ = high_ = lasso[0].y;
        for (const glm::dvec2& p : lasso) low_ = std::min(low_, p.y), high_ = std::max(high_, p.y);
        row_px_ = std::max(kLeastRow_px, (high_ - low_) / kMostRows);
        rows_.resize(row(high_) + 1);
        for (std::size_t i = 0; i < lasso.size(); ++i) {
            const double a = lasso[i].y, b = end_of(i).y;
            for (std::size_t r = row(std::min(a, b)); r <= row(std::max(a, b)); ++r)
                rows_[r].push_back(i);
        }
    }
    /// By the even-odd rule.
    bool has(const glm::dvec2& p) const {
        if (rows_.empty() || !(p.y >= low_ && p.y <= high_)) return false;
        bool inside = false;
        for (const std::size_t i : rows_[row(p.y)]) {
            const glm::dvec2 &a = lasso_[i], &b = end_of(i);
            if ((a.y > p.y) == (b.y > p.y)) continue;
            if (p.x < a.x + (p.y - a.y) * (b.x - a.x) / (b.y - a.y)) inside = !inside;
        }
        return inside;
    }

  private:
    static constexpr double kLeastRow_px = 2, kMostRows = 2048;
    const glm::dvec2& end_of(std::size_t edge) const { return lasso_[(edge + 1) % lasso_.size()]; }
    std::size_t row(double y) const { return static_cast<std::size_t>((y - low_) / row_px_); }
    const std::vector<glm::dvec2>& lasso_;
    double low_ = 0, high_ = 0, row_px_ = 1;
    std::vector<std::vector<std::size_t>> rows_;  // rows of edges, by where the edges begin
};

/// The segments of a stroke, sorted by the cells of the screen that they may cover, so that
/// millions of splats are looked up quickly.
class BrushCells {
  public:
    BrushCells(const std::vector<glm::dvec2>& stroke, double radius)
        : stroke_(stroke), radius_(radius) {
        if (stroke.empty()) return;
        glm::dvec2 high = low_ = stroke[0];
        for (const glm::dvec2& p : stroke) low_ = glm::min(low_, p), high = glm::max(high, p);
        low_ -= radius;
        const glm::dvec2 size = high + radius - low_;
        side_ = std::max({radius / 16, kLeastCell_px, std::max(size.x, size.y) / kMostCells});
        count_ = glm::ivec2(size / side_) + 1;
        cells_.resize(static_cast<std::size_t>(count_.x) * static_cast<std::size_t>(count_.y));
        for (std::size_t i = 0; i < stroke.size(); ++i) add(i);
    }
    bool has(const glm::dvec2& p) const {
        const glm::dvec2 at = glm::floor((p - low_) / side_);
        if (!(at.x >= 0 && at.y >= 0 && at.x < count_.x && at.y < count_.y)) return false;
        const Cell& cell = cells_[index(glm::ivec2(at))];
        return cell.whole || std::any_of(cell.segments.begin(), cell.segments.end(),
                                         [&](std::size_t i) { return distance(p, i) <= radius_; });
    }

  private:
    static constexpr double kLeastCell_px = 2, kMostCells = 1024;
    struct Cell {
        bool whole = false;  // one segment covers the cell
        std::vector<std::size_t> segments;
    };
    // The distance to the segment that ends at this point of the stroke.
    double distance(const glm::dvec2& p, std::size_t i) const {
        return distance_to_segment(p, stroke_[i > 0 ? i - 1 : 0], stroke_[i]);
    }
    std::size_t index(const glm::ivec2& at) const {
        return static_cast<std::size_t>(at.y) * static_cast<std::size_t>(count_.x) +
               static_cast<std::size_t>(at.x);
    }
    void add(std::size_t i) {
        const glm::dvec2 a = stroke_[i > 0 ? i - 1 : 0], b = stroke_[i];
        const glm::ivec2 from((glm::min(a, b) - radius_ - low_) / side_);
        const glm::ivec2 to((glm::max(a, b) + radius_ - low_) / side_);
        const double half = side_ * std::sqrt(0.5);  // half the diagonal of a cell
        for (int y = std::max(from.y, 0); y <= std::min(to.y, count_.y - 1); ++y)
            for (int x = std::max(from.x, 0); x <= std::min(to.x, count_.x - 1); ++x) {
                Cell& cell = cells_[index({x, y})];
                const double d = distance(low_ + side_ * (glm::dvec2(x, y) + 0.5), i);
                cell.whole |= d + half <= radius_;
                if (!cell.whole && d - half <= radius_) cell.segments.push_back(i);
            }
    }
    const std::vector<glm::dvec2>& stroke_;
    double radius_, side_ = 1;
    glm::dvec2 low_{0.0};
    glm::ivec2 count_{0};
    std::vector<Cell> cells_;
};

/// Splats sorted by the cube in which they lie.
class CubeGrid {
  public:
    CubeGrid(double side, const glm::dvec3& corner) : side_(side), corner_(corner) {}
    void add(const glm::dvec3& p) { cubes_[key(cube(p))].push_back(p); }
    bool any_nearer(const glm::dvec3& p) const {
        const Cube at = cube(p);
        for (int n = 0; n < 27; ++n) {
            const Cube near{at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1};
            const auto found = cubes_.find(key(near));
            if (found == cubes_.end()) continue;
            for (const glm::dvec3& q : found->second)
                if (glm::distance(p, q) < side_) return true;
        }
        return false;
    }

  private:
    using Cube = std::array<std::int64_t, 3>;
    Cube cube(const glm::dvec3& p) const {
        const glm::dvec3 c = glm::floor((p - corner_) / side_);
        constexpr double kFarCubes =
            1 << 21;  // splats farther away share cubes, which is only slower
        return {static_cast<std::int64_t>(std::fmod(c.x, kFarCubes)),
                static_cast<std::int64_t>(std::fmod(c.y, kFarCubes)),
                static_cast<std::int64_t>(std::fmod(c.z, kFarCubes))};
    }
    static std::uint64_t key(const Cube& c) {
        constexpr std::uint64_t kBits = (1U << 21) - 1;
        return (static_cast<std::uint64_t>(c[0]) & kBits) |
               (static_cast<std::uint64_t>(c[1]) & kBits) << 21 |
               (static_cast<std::uint64_t>(c[2]) & kBits) << 42;
    }
    double side_;
    glm::dvec3 corner_;
    std::unordered_map<std::uint64_t, std::vector<glm::dvec3>> cubes_;
};

}  // namespace

SplatSet in_rectangle(const SplatModel& model, const Camera& camera, glm::dvec2 a, glm::dvec2 b) {
    const glm::dvec2 low = glm::min(a, b), high = glm::max(a, b);
    return on_screen(model, camera, [&](const glm::dvec2& p) {
        return p.x >= low.x && p.y >= low.y && p.x <= high.x && p.y <= high.y;
    });
}

SplatSet in_lasso(const SplatModel& model, const Camera& camera,
                  const std::vector<glm::dvec2>& lasso) {
    const LassoRows rows(lasso);
    return on_screen(model, camera, [&](const glm::dvec2& p) { return rows.has(p); });
}

SplatSet under_brush(const SplatModel& model, const Camera& camera,
                     const std::vector<glm::dvec2>& stroke, double radius) {
    const BrushCells cells(stroke, radius);
    return on_screen(model, camera, [&](const glm::dvec2& p) { return cells.has(p); });
}

SplatSet in_region(const SplatModel& model, const Region& region) {
    return mask_of(model, [&](std::size_t i) { return region.contains(position_of(model, i)); });
}

SplatSet by_opacity(const SplatModel& model, double low, double high) {
    return mask_of(model, [&](std::size_t i) {
        const double opacity = sigmoid(double{model.opacity_logit[i]});
        return opacity >= low && opacity <= high;
    });
}

SplatSet by_scale(const SplatModel& model, double low, double high) {
    return mask_of(model, [&](std::size_t i) {
        const float* s = &model.log_scale[3 * i];
        const double scale = std::exp(double{std::max({s[0], s[1], s[2]})});
        return scale >= low && scale <= high;
    });
}

glm::dvec3 base_colour(const SplatModel& model, std::size_t splat) {
    const float* dc = &model.sh_dc[3 * splat];
    return 0.5 + kColourOfDc * glm::dvec3(dc[0], dc[1], dc[2]);
}

SplatSet by_colour(const SplatModel& model, const glm::dvec3& colour, double tolerance) {
    return mask_of(model, [&](std::size_t i) {
        const glm::dvec3 d = glm::abs(glm::clamp(base_colour(model, i), 0.0, 1.0) - colour);
        return std::max({d.x, d.y, d.z}) <= tolerance;
    });
}

SplatSet grown(const SplatModel& model, const SplatSet& mask, double distance) {
    DARB_CHECK(mask.size() == model.size() && distance > 0, "{} splats, {}, {}", model.size(),
               mask.size(), distance);
    CubeGrid grid(distance, model.origin);
    for (std::size_t i = 0; i < mask.size(); ++i)
        if (mask[i] != 0) grid.add(position_of(model, i));
    SplatSet result = mask;
    for (std::size_t i = 0; i < mask.size(); ++i)
        if (mask[i] == 0 && grid.any_nearer(position_of(model, i))) result[i] = 1;
    return result;
}

SplatSet connected(const SplatModel& model, const SplatSet& mask, const SplatSet& unseen) {
    DARB_CHECK(mask.size() == model.size() && unseen.size() == model.size(), "{} splats, {}, {}",
               model.size(), mask.size(), unseen.size());
    std::vector<std::uint32_t> seen;
    for (std::size_t i = 0; i < mask.size(); ++i)
        if (unseen[i] == 0) seen.push_back(static_cast<std::uint32_t>(i));
    const SplatParts parts = parts_of_splats(pick_splats(model, seen));
    SplatSet wanted(parts.mass.size(), 0), result = mask;
    for (std::size_t k = 0; k < seen.size(); ++k) wanted[parts.part[k]] |= mask[seen[k]];
    for (std::size_t k = 0; k < seen.size(); ++k) result[seen[k]] |= wanted[parts.part[k]];
    return result;
}

SplatSet flooded(const SplatModel& model, const glm::dvec3& at, double within,
                 const SplatSet& unseen) {
    const std::size_t n = model.size();
    DARB_CHECK(unseen.size() == n, "{} splats, {}", n, unseen.size());
    std::size_t first = n;
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < n; ++i) {
        const double distance = glm::distance(position_of(model, i), at);
        if (unseen[i] != 0 || !(distance < nearest)) continue;
        if (sigmoid(double{model.opacity_logit[i]}) < kFloodOpacity) continue;
        nearest = distance;
        first = i;
    }
    SplatSet seed(n, 0);
    if (first == n) return seed;
    seed[first] = 1;
    SplatSet apart = by_colour(model, glm::clamp(base_colour(model, first), 0.0, 1.0), within);
    for (std::size_t i = 0; i < n; ++i) apart[i] = apart[i] == 0 || unseen[i] != 0 ? 1 : 0;
    apart[first] = 0;  // also where its colour is no number
    return connected(model, seed, apart);
}

std::vector<SplatRun> ranges_of(const SplatSet& set) {
    std::vector<SplatRun> ranges;
    for (std::size_t i = 0; i < set.size(); ++i) {
        if (set[i] == 0) continue;
        if (i == 0 || set[i - 1] == 0) ranges.push_back({static_cast<std::uint32_t>(i), 0});
        ++ranges.back().count;
    }
    return ranges;
}

std::vector<std::uint32_t> splats_in(const std::vector<SplatRun>& ranges) {
    std::vector<std::uint32_t> splats;
    for (const SplatRun& range : ranges)
        for (std::uint32_t i = 0; i < range.count; ++i) splats.push_back(range.first + i);
    return splats;
}

SplatSet set_of_ranges(const std::vector<SplatRun>& ranges, std::size_t size) {
    SplatSet set(size, 0);
    for (const SplatRun& range : ranges) {
        if (range.first > size || range.count > size - range.first)
            throw Error("selection",
                        fmt::format("names splat {} of a scene that has {}",
                                    std::uint64_t{range.first} + range.count - 1, size),
                        "The edits are of another scene, or its file has changed since.");
        std::fill_n(set.begin() + range.first, range.count, std::uint8_t{1});
    }
    return set;
}

double distance_to_segment(const glm::dvec2& p, const glm::dvec2& a, const glm::dvec2& b) {
    const glm::dvec2 along = b - a;
    const double square = glm::dot(along, along);
    const double t = square > 0 ? std::clamp(glm::dot(p - a, along) / square, 0.0, 1.0) : 0;
    return glm::distance(p, a + t * along);
}

}  // namespace darb
