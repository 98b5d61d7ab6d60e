#include "viewer/edit.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "engine/core/error.h"

namespace darb {

namespace {

std::string counted(const char* verb, std::size_t count) {
    return fmt::format("{} {} splat{}", verb, count, count == 1 ? "" : "s");
}

// The splats of `part` take the place of these in the model.
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

// Zeros for the bands above.
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
    const auto turn = [](const std::vector<std::uint32_t>& splats, SplatMask& mask,
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

std::size_t Edit::select(const SplatMask& mask, Combine how) {
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
    SplatMask mask(selected_.size());
    for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = selected_[i] ^ 1;
    return select(mask, Combine::replace);
}

std::size_t Edit::remove(const SplatMask& mask) {
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
    SplatMask mask = in_region(model, region);
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
    changed_model();  // what waited for the end of the move follows
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
    for (SplatMask* mask : {&removed_, &hidden_}) mask->resize(model.size(), 0);
    selected_.resize(model.size(), 1);
    selected_count_ = added.size();
    changed_model();
}

void Edit::cut(const Merged& merged, SplatModel& model) {
    const std::size_t left = model.size() - merged.added.size();
    for (SplatMask* mask : {&removed_, &hidden_, &selected_}) mask->resize(left);
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
                    fmt::format("is of the kernel {}, this one of {}, or differs in footprint or "
                                "antialiasing",
                                kernel_name(added.kernel), kernel_name(model.kernel)),
                    "One scene has one of each: train or convert both alike.");
    for (int a = 0; a < kAttributeCount; ++a)
        if (kSplatAttributes[static_cast<std::size_t>(a)].optional && added.size() > 0 &&
            model.size() > 0 && (added.floats(a) == 0) != (model.floats(a) == 0))
            throw Error("the scene to merge", "has an attribute that this one lacks, or lacks one",
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

SplatMask Edit::unseen() const {
    SplatMask mask = removed_;
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
    keep_splats([&](std::size_t i) { return removed_[i] == 0; }, out);
    return out;
}

}  // namespace darb
