// SPDX-License-Identifier: MIT
#include "engine/scene/edit.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "engine/core/count_text.h"
#include "engine/core/error.h"
#include "engine/scene/edit_text.h"

namespace darb {

namespace {

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

std::string counted_splats(const char* verb, std::size_t count) {
    return fmt::format("{} {}", verb, counted(count, "splat"));
}

LayerLook look_of(const SplatModel& model) {
    return {model.kernel, model.footprint, model.antialias};
}

Edit::Edit(std::size_t splats, double metres_per_unit)
    : removed_(splats, 0), hidden_(splats, 0), selected_(splats, 0), veiled_(splats, 0) {
    facts_.metres_per_unit = metres_per_unit;
    layers_.push_back({"scene", {}, true, {}, {}, {{0, static_cast<std::uint32_t>(splats)}}});
}

Edit::Edit(const SplatModel& model, std::string name, std::filesystem::path file)
    : Edit(model.size(), model.metres_per_unit) {
    layers_[0].name = std::move(name);
    layers_[0].file = std::move(file);
    layers_[0].look = look_of(model);
}

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

std::size_t Edit::mark(const char* verb, Marks marks, bool content, EditOperation operation) {
    const std::size_t changed =
        std::max({marks.removed.size(), marks.hidden.size(), marks.selected.size()});
    if (changed == 0) return 0;
    flip(marks);
    const bool selects = marks.removed.empty() && marks.hidden.empty();
    const std::size_t told = selects ? selected_count_ : changed;
    Step step{counted_splats(verb, told), content ? ++last_id_ : 0, {}, std::move(operation)};
    step.changes.emplace_back(std::move(marks));
    push(std::move(step));
    return changed;
}

std::size_t Edit::select(const SplatSet& mask, Combine how) {
    return select(mask, how, edits::Select{by::Numbers{ranges_of(mask)}, how});
}

std::size_t Edit::select(const SplatSet& mask, Combine how, EditOperation operation) {
    DARB_CHECK(mask.size() == selected_.size(), "{} splats, {}", mask.size(), selected_.size());
    Marks marks;
    for (std::size_t i = 0; i < mask.size(); ++i) {
        const bool free = removed_[i] == 0 && hidden_[i] == 0 && veiled_[i] == 0;
        const bool was = selected_[i] != 0, hit = mask[i] != 0 && free;
        const bool is = how == Combine::replace ? hit
                        : how == Combine::add   ? was || hit
                                                : was && !hit;
        if (is != was) marks.selected.push_back(static_cast<std::uint32_t>(i));
    }
    return mark("selected", std::move(marks), false, std::move(operation));
}

std::size_t Edit::invert_selection() {
    SplatSet mask(selected_.size());
    for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = selected_[i] ^ 1;
    return select(mask, Combine::replace, edits::Invert{});
}

Edit::Marks Edit::removing(const SplatSet& mask, bool veiled_too) const {
    Marks marks;
    for (std::size_t i = 0; i < mask.size(); ++i) {
        if (mask[i] == 0 || removed_[i] != 0 || (veiled_[i] != 0 && !veiled_too)) continue;
        marks.removed.push_back(static_cast<std::uint32_t>(i));
        if (selected_[i] != 0) marks.selected.push_back(static_cast<std::uint32_t>(i));
    }
    return marks;
}

std::size_t Edit::remove(const SplatSet& mask) {
    return remove(mask, edits::Remove{by::Numbers{ranges_of(mask)}, false});
}

std::size_t Edit::remove_selected() {
    return remove(selected_, edits::Remove{});
}

std::size_t Edit::remove(const SplatSet& mask, EditOperation operation) {
    DARB_CHECK(mask.size() == removed_.size(), "{} splats, {}", mask.size(), removed_.size());
    return mark("deleted", removing(mask, false), true, std::move(operation));
}

std::size_t Edit::remove(const SplatModel& model, const Region& region, bool inside) {
    SplatSet mask = in_region(model, region);
    for (std::uint8_t& hit : mask) hit = (hit != 0) == inside ? 1 : 0;
    return remove(mask, edits::Remove{region, !inside});
}

std::size_t Edit::hide_selected() {
    Marks marks;
    for (std::size_t i = 0; i < selected_.size(); ++i)
        if (selected_[i] != 0) marks.selected.push_back(static_cast<std::uint32_t>(i));
    marks.hidden = marks.selected;
    return mark("hid", std::move(marks), false, edits::Hide{});
}

std::size_t Edit::show_hidden() {
    Marks marks;
    for (std::size_t i = 0; i < hidden_.size(); ++i)
        if (hidden_[i] != 0) marks.hidden.push_back(static_cast<std::uint32_t>(i));
    return mark("showed", std::move(marks), false, edits::Show{});
}

std::vector<std::uint32_t> Edit::moved_splats() const {
    std::vector<std::uint32_t> splats;
    for (std::size_t i = 0; i < removed_.size(); ++i)
        if (selected_count_ > 0 ? selected_[i] != 0
                                : removed_[i] == 0 && hidden_[i] == 0 && veiled_[i] == 0)
            splats.push_back(static_cast<std::uint32_t>(i));
    return splats;
}

void Edit::begin_transform(const SplatModel& model) {
    begin_transform(model, moved_splats());
}

void Edit::begin_transform(const SplatModel& model, std::vector<std::uint32_t> splats) {
    DARB_CHECK(model.size() == removed_.size(), "{} splats, {}", model.size(), removed_.size());
    Moved moved;
    moved.splats = std::move(splats);
    moved.other = pick_splats(model, moved.splats);
    dragged_ = std::move(moved);
    drag_.reset();
}

void Edit::drag_transform(const Similarity& total, SplatModel& model) {
    if (!dragged_) return;
    SplatModel after = dragged_->other;
    transform_splats(total, after);
    count_from(model.origin, after);
    put_splats(dragged_->splats, after, model);
    drag_ = total;
    changed_model();
}

std::size_t Edit::end_transform(const SplatModel& model) {
    return end_transform(model, "");
}

std::size_t Edit::end_transform(const SplatModel& model, const std::string& layer) {
    if (!dragged_) return 0;
    Moved moved = *std::exchange(dragged_, std::nullopt);
    const std::size_t count = moved.splats.size();
    if (count == 0 || !drag_) return 0;
    DARB_CHECK(model.size() == removed_.size(), "{} splats, {}", model.size(), removed_.size());
    Step step{counted_splats("moved", count), ++last_id_, {}, edits::Transform{*drag_, layer}};
    step.changes.emplace_back(Layered{std::exchange(layers_, layers_after_move(moved.splats))});
    step.changes.emplace_back(std::move(moved));
    push(std::move(step));
    changed_model();  // updates what waited for the end of the move
    return count;
}

void Edit::cancel_transform(SplatModel& model) {
    if (!dragged_) return;
    const Moved moved = *std::exchange(dragged_, std::nullopt);
    put_splats(moved.splats, moved.other, model);
    changed_model();
}

// A layer has moved as a whole where none of its splats stayed.
std::vector<SceneLayer> Edit::layers_after_move(const std::vector<std::uint32_t>& splats) const {
    SplatSet moved(removed_.size(), 0);
    for (const std::uint32_t i : splats) moved[i] = 1;
    std::vector<SceneLayer> next = layers_;
    for (SceneLayer& layer : next) {
        const std::vector<std::uint32_t> live = live_splats(layer);
        if (!live.empty() &&
            std::ranges::all_of(live, [&](std::uint32_t i) { return moved[i] != 0; }))
            layer.moved = followed_by(layer.moved, *drag_);
    }
    return next;
}

void Edit::append(const Merged& merged, SplatModel& model) {
    const SplatModel& added = merged.added;
    const std::size_t before = model.size();
    raise_sh_degree(added.sh_degree, model);
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::vector<float>& more = attribute_values(added, a);
        std::vector<float>& values = attribute_values(model, a);
        const bool held = !values.empty() || !more.empty();
        if (held && kSplatAttributes[static_cast<std::size_t>(a)].optional)
            values.resize(before * attribute_floats(a, model.sh_degree), 0.0f);
        values.insert(values.end(), more.begin(), more.end());
        if (held) values.resize((before + added.size()) * attribute_floats(a, model.sh_degree));
    }
    for (const std::uint32_t i : merged.selected) selected_[i] = 0;
    for (SplatSet* mask : {&removed_, &hidden_, &veiled_}) mask->resize(model.size(), 0);
    selected_.resize(model.size(), 1);
    selected_count_ = added.size();
    changed_model();
}

void Edit::cut(const Merged& merged, SplatModel& model) {
    const std::size_t left = model.size() - merged.added.size();
    for (SplatSet* mask : {&removed_, &hidden_, &selected_, &veiled_}) mask->resize(left);
    for (const std::uint32_t i : merged.selected) selected_[i] = 1;
    selected_count_ = merged.selected.size();
    model.resize(left);
    if (!merged.shapes) model.shape.clear();
    limit_sh_degree(merged.degree, model);
    changed_model();
}

std::size_t Edit::merge(SplatModel added, SplatModel& model, const edits::Add& source) {
    SceneLayer layer;
    layer.name = !source.name.empty()  ? source.name
                 : source.file.empty() ? "scene"
                                       : source.file.stem().string();
    layer.file = source.file;
    layer.look = look_of(added);
    const std::string what = counted_splats("merged", added.size());
    edits::Add operation{source.file, free_name(layer.name)};
    return append_layer(std::move(added), std::move(layer), what, std::move(operation), model);
}

std::size_t Edit::append_layer(SplatModel added, SceneLayer layer, std::string what,
                               EditOperation operation, SplatModel& model) {
    const std::size_t count = added.size();
    if (count == 0) return 0;
    raise_sh_degree(model.sh_degree, added);
    count_from(model.origin, added);
    layer.name = free_name(layer.name);
    layer.splats = {{static_cast<std::uint32_t>(model.size()), static_cast<std::uint32_t>(count)}};
    std::vector<SceneLayer> next = layers_;
    next.push_back(std::move(layer));
    Merged merged{std::move(added), model.sh_degree, !model.shape.empty(), {}};
    for (std::size_t i = 0; i < selected_.size(); ++i)
        if (selected_[i] != 0) merged.selected.push_back(static_cast<std::uint32_t>(i));
    Step step{std::move(what), ++last_id_, {}, std::move(operation)};
    step.changes.emplace_back(std::move(merged));
    step.changes.emplace_back(Layered{std::move(next)});
    for (Change& change : step.changes) apply_change(change, true, model);
    push(std::move(step));
    return count;
}

std::size_t Edit::state(const SceneFacts& facts, std::string what, bool content) {
    if (facts == facts_) return 0;
    Step step{std::move(what), content ? ++last_id_ : 0, {}, {}};
    if (facts.metres_per_unit != facts_.metres_per_unit)
        step.operation = edits::StateUnit{facts.metres_per_unit};
    else if (facts.ground != facts_.ground || (facts.ground && facts.up != facts_.up))
        step.operation = edits::StateGround{facts.ground ? facts.up : std::nullopt};
    step.changes.emplace_back(Stated{std::exchange(facts_, facts)});
    push(std::move(step));
    ++version_;
    return 1;
}

void Edit::note_measured(Measurement measured, std::vector<SceneNote> notes) {
    facts_.measured = std::move(measured);
    facts_.notes = std::move(notes);
}

std::vector<std::size_t> Edit::parts() const {
    std::vector<std::size_t> parts = {removed_.size()};
    for (std::size_t i = 0; i < done_; ++i)
        for (const Change& change : steps_[i].changes)
            if (const auto* merged = std::get_if<Merged>(&change)) {
                parts.push_back(merged->added.size());
                parts.front() -= parts.back();
            }
    return parts;
}

void Edit::apply_change(Change& change, bool forward, SplatModel& model) {
    if (const auto* marks = std::get_if<Marks>(&change)) {
        flip(*marks);
    } else if (auto* moved = std::get_if<Moved>(&change)) {
        SplatModel now = pick_splats(model, moved->splats);
        put_splats(moved->splats, moved->other, model);
        moved->other = std::move(now);
        changed_model();
    } else if (const auto* merged = std::get_if<Merged>(&change)) {
        if (forward)
            append(*merged, model);
        else
            cut(*merged, model);
    } else if (auto* stated = std::get_if<Stated>(&change)) {
        std::swap(stated->other, facts_);
        ++version_;
    } else if (auto* layered = std::get_if<Layered>(&change)) {
        swap_layers(*layered, model);
    }
}

std::string Edit::undo(SplatModel& model) {
    if (!can_undo()) return "";
    Step& step = steps_[--done_];
    for (auto change = step.changes.rbegin(); change != step.changes.rend(); ++change)
        apply_change(*change, false, model);
    return step.what;
}

void Edit::take_back(SplatModel& model) {
    if (undo(model).empty()) return;
    steps_.resize(done_);
}

std::string Edit::redo(SplatModel& model) {
    if (!can_redo()) return "";
    Step& step = steps_[done_++];
    for (Change& change : step.changes) apply_change(change, true, model);
    return step.what;
}

const std::string& Edit::last() const {
    static const std::string none;
    return done_ > 0 ? steps_[done_ - 1].what : none;
}

SplatSet Edit::unseen() const {
    SplatSet mask = removed_;
    for (std::size_t i = 0; i < mask.size(); ++i) {
        mask[i] |= hidden_[i];
        mask[i] |= veiled_[i];
    }
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

std::vector<EditOperation> Edit::operations() const {
    std::vector<EditOperation> all;
    for (std::size_t i = 0; i < done_; ++i)
        if (steps_[i].operation) all.push_back(*steps_[i].operation);
    return all;
}

// The middle of the scene stays where it is on earth.
EarthPlace Edit::stated_place(const SplatModel& model) const {
    EarthPlace place = model.place;
    if (!place.known() || model.size() == 0) return place;
    glm::dvec3 middle(0.0);
    for (std::size_t i = 0; i < model.size(); ++i)
        middle += position_of(model, i) / static_cast<double>(model.size());
    place.offset += (model.metres_per_unit - facts_.metres_per_unit) * (place.rotation * middle);
    return place;
}

SplatModel Edit::apply(const SplatModel& model) const {
    SplatModel out;
    if (const std::optional<SplatModel> drawn = drawn_otherwise(model))
        out = pick_splats(*drawn, visible_splats());
    else
        out = pick_splats(model, visible_splats());
    out.place = stated_place(model);
    out.metres_per_unit = facts_.metres_per_unit;
    return out;
}

SplatModel Edit::apply(const SplatModel& model, const SceneLayer& layer) const {
    SplatModel out = picked(model, live_splats(layer), layer.look);
    out.place = stated_place(model);
    out.metres_per_unit = facts_.metres_per_unit;
    return out;
}

}  // namespace darb
