// SPDX-License-Identifier: MIT
// What each operation does, the same for the window, scripts and projects.
#include "engine/scene/edit_operation.h"

#include <fmt/format.h>

#include <utility>

#include "engine/core/error.h"
#include "engine/scene/edit.h"

namespace darb {

// What each operation does.

namespace {

template <class... Kinds>
struct EachKind : Kinds... {
    using Kinds::operator()...;
};
template <class... Kinds>
EachKind(Kinds...) -> EachKind<Kinds...>;

}  // namespace

SplatSet Edit::meant(const Selector& what, const SplatModel& model) const {
    const std::size_t n = model.size();
    return std::visit(
        EachKind{
            [&](by::Everything) { return SplatSet(n, 1); },
            [&](by::Nothing) { return SplatSet(n, 0); },
            [&](const Region& region) { return in_region(model, region); },
            [&](const by::Rectangle& r) { return in_rectangle(model, r.view, r.from, r.to); },
            [&](const by::Polygon& p) { return in_lasso(model, p.view, p.outline); },
            [&](const by::Brush& b) { return under_brush(model, b.view, b.stroke, b.radius); },
            [&](const by::Opacity& o) { return by_opacity(model, o.low, o.high); },
            [&](const by::Size& s) { return by_scale(model, s.low, s.high); },
            [&](const by::Colour& c) { return by_colour(model, c.colour, c.within); },
            [&](const by::Isolated& i) { return isolated_splats(model, i.share); },
            [&](const by::Haze& h) { return hazy_splats(model, h.opacity, h.size); },
            [&](const by::Near& near) { return grown(model, selected_, near.distance); },
            [&](by::Connected) { return connected(model, selected_, unseen()); },
            [&](const by::Flood& f) { return flooded(model, f.at, f.within, unseen()); },
            [&](const by::Layer& layer) {
                return set_of_ranges(layers_[layer_named(layer.name)].splats, n);
            },
            [&](const by::Numbers& numbers) { return set_of_ranges(numbers.ranges, n); },
        },
        what);
}

std::size_t Edit::transform(const edits::Transform& move, SplatModel& model) {
    begin_transform(
        model, move.layer.empty() ? moved_splats() : live_splats(layers_[layer_named(move.layer)]));
    try {
        drag_transform(move.by, model);
    } catch (...) {
        cancel_transform(model);
        throw;
    }
    return end_transform(model, move.layer);
}

std::size_t Edit::perform(const EditOperation& operation, SplatModel& model,
                          const ReadScene& read) {
    return std::visit(
        EachKind{
            [&](const edits::Select& s) { return select(meant(s.what, model), s.how, s); },
            [&](edits::Invert) { return invert_selection(); },
            [&](const edits::Remove& r) {
                SplatSet mask = r.what ? meant(*r.what, model) : selected_;
                if (r.others)
                    for (std::uint8_t& hit : mask) hit ^= 1;
                return remove(mask, r);
            },
            [&](edits::Hide) { return hide_selected(); },
            [&](edits::Show) { return show_hidden(); },
            [&](const edits::Transform& t) { return transform(t, model); },
            [&](const edits::Add& a) {
                if (!read)
                    throw Error(a.file.string(), "cannot be added here",
                                "Leave this edit out of the script.");
                return merge(read(a.file), model, a);
            },
            [&](const edits::Duplicate& d) { return duplicate(d, model); },
            [&](const edits::ShowLayer& s) { return show_layer(s, model); },
            [&](const edits::RenameLayer& r) { return rename_layer(r, model); },
            [&](const edits::PlaceLayer& p) { return place_layer(p, model); },
            [&](const edits::RemoveLayer& r) { return remove_layer(r, model); },
            [&](const edits::MergeLayers& m) { return merge_layers(m, model); },
            [&](const edits::StateUnit& u) {
                SceneFacts facts = facts_;
                facts.metres_per_unit = u.metres_per_unit;
                return state(facts,
                             fmt::format("set the scale: a unit is {:.4g} m", u.metres_per_unit),
                             true);
            },
            [&](const edits::StateGround& g) {
                SceneFacts facts = facts_;
                facts.ground = g.up.has_value();
                if (g.up) facts.up = g.up;
                return state(facts, "set the ground: it is saved level", true);
            },
        },
        operation);
}

}  // namespace darb
