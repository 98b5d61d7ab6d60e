// SPDX-License-Identifier: MIT
#include "viewer/edit.h"

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
#include "viewer/view_camera.h"

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
        constexpr double kFar = 1 << 21;  // splats farther away share cubes, which is only slower
        return {static_cast<std::int64_t>(std::fmod(c.x, kFar)),
                static_cast<std::int64_t>(std::fmod(c.y, kFar)),
                static_cast<std::int64_t>(std::fmod(c.z, kFar))};
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

namespace {

std::string counted(const char* verb, std::size_t count) {
    return fmt::format("{} {} splat{}", verb, count, count == 1 ? "" : "s");
}

// Puts the splats of `part` back in place of these splats of the model.
void put_back(const std::vector<std::uint32_t>& splats, const SplatModel& part, SplatModel& model) {
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::vector<float>& from = attribute_values(part, a);
        std::vector<float>& to = attribute_values(model, a);
        const std::size_t floats = model.floats(a);
        for (std::size_t i = 0; i < splats.size(); ++i)
            std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(i * floats), floats,
                        to.begin() + static_cast<std::ptrdiff_t>(splats[i] * floats));
    }
}

void count_from(const glm::dvec3& origin, SplatModel& model) {
    const glm::dvec3 shift = model.origin - origin;
    model.origin = origin;
    if (shift == glm::dvec3(0.0)) return;
    for (std::size_t i = 0; i < model.position.size(); ++i)
        model.position[i] =
            static_cast<float>(double{model.position[i]} + shift[static_cast<int>(i % 3)]);
}

// The bands above become zeros.
void raise_sh_degree(int degree, SplatModel& model) {
    if (degree <= model.sh_degree) return;
    const std::size_t before = static_cast<std::size_t>(model.rest_count());
    model.sh_degree = degree;
    const std::size_t after = static_cast<std::size_t>(model.rest_count());
    std::vector<float> rest(model.size() * after, 0.0f);
    for (std::size_t i = 0; i < model.size(); ++i)
        std::copy_n(model.sh_rest.begin() + static_cast<std::ptrdiff_t>(i * before), before,
                    rest.begin() + static_cast<std::ptrdiff_t>(i * after));
    model.sh_rest = std::move(rest);
}

}  // namespace

void Edit::flip(const Marks& marks) {
    const auto turn = [](const std::vector<std::uint32_t>& splats, SplatSet& mask,
                         std::size_t& count) {
        for (const std::uint32_t i : splats) {
            mask[i] ^= 1;
            count += mask[i] != 0 ? 1 : -std::size_t{1};
        }
    };
    ++version_;
    if (!marks.removed.empty() || !marks.hidden.empty()) ++seen_version_;
    turn(marks.removed, removed_, removed_count_);
    turn(marks.hidden, hidden_, hidden_count_);
    turn(marks.selected, selected_, selected_count_);
}

void Edit::push(Step step) {
    steps_.resize(done_);
    steps_.push_back(std::move(step));
    done_ = steps_.size();
}

std::size_t Edit::mark(const char* verb, Marks marks, bool content) {
    const std::size_t changed =
        std::max({marks.removed.size(), marks.hidden.size(), marks.selected.size()});
    if (changed == 0) return 0;
    flip(marks);
    const bool selects = marks.removed.empty() && marks.hidden.empty();
    const std::size_t told = selects ? selected_count_ : changed;
    push({counted(verb, told), content ? ++last_id_ : 0, std::move(marks)});
    return changed;
}

std::size_t Edit::select(const SplatSet& mask, Combine how) {
    DARB_CHECK(mask.size() == selected_.size(), "{} splats, {}", mask.size(), selected_.size());
    Marks marks;
    for (std::size_t i = 0; i < mask.size(); ++i) {
        const bool free = removed_[i] == 0 && hidden_[i] == 0, was = selected_[i] != 0;
        const bool hit = mask[i] != 0 && free;
        const bool is = how == Combine::replace ? hit
                        : how == Combine::add   ? was || hit
                                                : was && !hit;
        if (is != was) marks.selected.push_back(static_cast<std::uint32_t>(i));
    }
    return mark("selected", std::move(marks), false);
}

std::size_t Edit::invert_selection() {
    SplatSet mask(selected_.size());
    for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = selected_[i] ^ 1;
    return select(mask, Combine::replace);
}

std::size_t Edit::remove(const SplatSet& mask) {
    DARB_CHECK(mask.size() == removed_.size(), "{} splats, {}", mask.size(), removed_.size());
    Marks marks;
    for (std::size_t i = 0; i < mask.size(); ++i) {
        if (mask[i] == 0 || removed_[i] != 0) continue;
        marks.removed.push_back(static_cast<std::uint32_t>(i));
        if (selected_[i] != 0) marks.selected.push_back(static_cast<std::uint32_t>(i));
    }
    return mark("deleted", std::move(marks), true);
}

std::size_t Edit::remove(const SplatModel& model, const Region& region, bool inside) {
    SplatSet mask = in_region(model, region);
    for (std::uint8_t& hit : mask) hit = (hit != 0) == inside ? 1 : 0;
    return remove(mask);
}

std::size_t Edit::hide_selected() {
    Marks marks;
    for (std::size_t i = 0; i < selected_.size(); ++i)
        if (selected_[i] != 0) marks.selected.push_back(static_cast<std::uint32_t>(i));
    marks.hidden = marks.selected;
    return mark("hid", std::move(marks), false);
}

std::size_t Edit::show_hidden() {
    Marks marks;
    for (std::size_t i = 0; i < hidden_.size(); ++i)
        if (hidden_[i] != 0) marks.hidden.push_back(static_cast<std::uint32_t>(i));
    return mark("showed", std::move(marks), false);
}

std::vector<std::uint32_t> Edit::moved_splats() const {
    std::vector<std::uint32_t> splats;
    for (std::size_t i = 0; i < removed_.size(); ++i)
        if (selected_count_ > 0 ? selected_[i] != 0 : removed_[i] == 0 && hidden_[i] == 0)
            splats.push_back(static_cast<std::uint32_t>(i));
    return splats;
}

void Edit::begin_transform(const SplatModel& model) {
    DARB_CHECK(model.size() == removed_.size(), "{} splats, {}", model.size(), removed_.size());
    Moved moved;
    moved.splats = moved_splats();
    moved.other = pick_splats(model, moved.splats);
    dragged_ = std::move(moved);
    was_dragged_ = false;
}

void Edit::drag_transform(const Similarity& total, SplatModel& model) {
    if (!dragged_) return;
    SplatModel after = dragged_->other;
    transform_splats(total, after);
    count_from(model.origin, after);
    put_back(dragged_->splats, after, model);
    was_dragged_ = true;
    changed_model();
}

std::size_t Edit::end_transform(const SplatModel& model) {
    if (!dragged_) return 0;
    Moved moved = *std::exchange(dragged_, std::nullopt);
    const std::size_t count = moved.splats.size();
    if (count == 0 || !was_dragged_) return 0;
    DARB_CHECK(model.size() == removed_.size(), "{} splats, {}", model.size(), removed_.size());
    push({counted("moved", count), ++last_id_, std::move(moved)});
    changed_model();  // updates what waited for the end of the move
    return count;
}

void Edit::cancel_transform(SplatModel& model) {
    if (!dragged_) return;
    const Moved moved = *std::exchange(dragged_, std::nullopt);
    put_back(moved.splats, moved.other, model);
    changed_model();
}

void Edit::append(const Merged& merged, SplatModel& model) {
    const SplatModel& added = merged.added;
    raise_sh_degree(added.sh_degree, model);
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::vector<float>& more = attribute_values(added, a);
        std::vector<float>& values = attribute_values(model, a);
        values.insert(values.end(), more.begin(), more.end());
    }
    for (const std::uint32_t i : merged.selected) selected_[i] = 0;
    for (SplatSet* mask : {&removed_, &hidden_}) mask->resize(model.size(), 0);
    selected_.resize(model.size(), 1);
    selected_count_ = added.size();
    changed_model();
}

void Edit::cut(const Merged& merged, SplatModel& model) {
    const std::size_t left = model.size() - merged.added.size();
    for (SplatSet* mask : {&removed_, &hidden_, &selected_}) mask->resize(left);
    for (const std::uint32_t i : merged.selected) selected_[i] = 1;
    selected_count_ = merged.selected.size();
    model.resize(left);
    limit_sh_degree(merged.degree, model);
    changed_model();
}

std::size_t Edit::merge(SplatModel added, SplatModel& model) {
    if (added.kernel != model.kernel || added.footprint != model.footprint ||
        added.antialias != model.antialias)
        throw Error("the scene to merge",
                    fmt::format("has the kernel {}, this one {}, or differs in footprint or "
                                "antialiasing",
                                kernel_name(added.kernel), kernel_name(model.kernel)),
                    "A scene has one of each; train or convert both alike.");
    for (int a = 0; a < kAttributeCount; ++a)
        if (kSplatAttributes[static_cast<std::size_t>(a)].optional && added.size() > 0 &&
            model.size() > 0 && (added.floats(a) == 0) != (model.floats(a) == 0))
            throw Error("the scene to merge",
                        "has an attribute that this one lacks, or the other way round",
                        "Merge scenes that were trained alike.");
    raise_sh_degree(model.sh_degree, added);
    count_from(model.origin, added);
    const std::size_t count = added.size();
    if (count == 0) return 0;
    Merged merged{std::move(added), model.sh_degree, {}};
    for (std::size_t i = 0; i < selected_.size(); ++i)
        if (selected_[i] != 0) merged.selected.push_back(static_cast<std::uint32_t>(i));
    append(merged, model);
    push({counted("merged", count), ++last_id_, std::move(merged)});
    return count;
}

std::size_t Edit::state(const SceneFacts& facts, std::string what, bool content) {
    if (facts == facts_) return 0;
    push({std::move(what), content ? ++last_id_ : 0, Stated{std::exchange(facts_, facts)}});
    ++version_;
    return 1;
}

std::vector<std::size_t> Edit::parts() const {
    std::vector<std::size_t> parts = {removed_.size()};
    for (std::size_t i = 0; i < done_; ++i)
        if (const auto* merged = std::get_if<Merged>(&steps_[i].change)) {
            parts.push_back(merged->added.size());
            parts.front() -= parts.back();
        }
    return parts;
}

void Edit::apply_step(Step& step, bool forward, SplatModel& model) {
    if (const auto* marks = std::get_if<Marks>(&step.change)) {
        flip(*marks);
    } else if (auto* moved = std::get_if<Moved>(&step.change)) {
        SplatModel now = pick_splats(model, moved->splats);
        put_back(moved->splats, moved->other, model);
        moved->other = std::move(now);
        changed_model();
    } else if (const auto* merged = std::get_if<Merged>(&step.change)) {
        if (forward)
            append(*merged, model);
        else
            cut(*merged, model);
    } else if (auto* stated = std::get_if<Stated>(&step.change)) {
        std::swap(stated->other, facts_);
        ++version_;
    }
}

std::string Edit::undo(SplatModel& model) {
    if (!can_undo()) return "";
    apply_step(steps_[--done_], false, model);
    return steps_[done_].what;
}

void Edit::take_back(SplatModel& model) {
    if (undo(model).empty()) return;
    steps_.resize(done_);
}

std::string Edit::redo(SplatModel& model) {
    if (!can_redo()) return "";
    apply_step(steps_[done_++], true, model);
    return steps_[done_ - 1].what;
}

const std::string& Edit::last() const {
    static const std::string none;
    return done_ > 0 ? steps_[done_ - 1].what : none;
}

SplatSet Edit::unseen() const {
    SplatSet mask = removed_;
    for (std::size_t i = 0; i < mask.size(); ++i) mask[i] |= hidden_[i];
    return mask;
}

int Edit::content() const {
    for (std::size_t i = done_; i > 0; --i)
        if (steps_[i - 1].id != 0) return steps_[i - 1].id;
    return 0;
}

bool Edit::unsaved() const {
    const int now = content();
    return now != 0 && now != saved_;
}

SplatModel Edit::apply(const SplatModel& model) const {
    SplatModel out = model;
    if (out.place.known() && out.size() > 0) {  // the middle of the scene stays where it is
        glm::dvec3 middle(0.0);
        for (std::size_t i = 0; i < out.size(); ++i)
            middle += position_of(out, i) / static_cast<double>(out.size());
        out.place.offset +=
            (out.metres_per_unit - facts_.metres_per_unit) * (out.place.rotation * middle);
    }
    out.metres_per_unit = facts_.metres_per_unit;
    keep_splats([&](std::size_t i) { return removed_[i] == 0; }, out);
    return out;
}

}  // namespace darb
