// SPDX-License-Identifier: MIT
// Layers of an edit: ranges of the one model, so that splats of all layers are sorted together.
// Where visible layers have different kernels, a picture, which has one, takes their Gaussians.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "engine/core/error.h"
#include "engine/kernels/kernel_profile.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/scene/dot_splat.h"
#include "engine/scene/edit.h"
#include "engine/scene/edit_text.h"

namespace darb {

namespace {

void set_look(const LayerLook& look, SplatModel& model) {
    model.kernel = look.kernel;
    model.footprint = look.footprint;
    model.antialias = look.antialias;
}

/// The two in one list, ascending, with neighbours joined.
std::vector<SplatRun> joined_ranges(std::vector<SplatRun> a, const std::vector<SplatRun>& b) {
    a.insert(a.end(), b.begin(), b.end());
    std::ranges::sort(a, {}, &SplatRun::first);
    std::vector<SplatRun> all;
    for (const SplatRun& range : a)
        if (!all.empty() && all.back().first + all.back().count == range.first)
            all.back().count += range.count;
        else
            all.push_back(range);
    return all;
}

}  // namespace

std::size_t Edit::duplicate(const edits::Duplicate& copy, SplatModel& model) {
    std::vector<std::uint32_t> splats;
    std::set<std::size_t> from;
    if (!copy.layer.empty()) {
        from.insert(layer_named(copy.layer));
        splats = live_splats(layers_[*from.begin()]);
    }
    for (std::size_t n = 0; copy.layer.empty() && n < layers_.size(); ++n)
        for (const std::uint32_t i : splats_in(layers_[n].splats))
            if (selected_[i] != 0) splats.push_back(i), from.insert(n);
    if (splats.empty()) return 0;
    const SceneLayer& first = layers_[*from.begin()];
    for (const std::size_t n : from)
        if (!(layers_[n].look == first.look))
            throw Error("copy", "the selection is of layers with different kernels",
                        "Copy what is selected of one layer at a time.");
    SceneLayer layer = first;
    layer.name = copy.name.empty() ? first.name + " copy" : copy.name;
    layer.file.clear();
    layer.visible = true;
    if (copy.layer.empty()) layer.moved = {};
    edits::Duplicate operation = copy;
    operation.name = free_name(layer.name);
    const std::string what = counted_splats("copied", splats.size());
    return append_layer(picked(model, splats, layer.look), std::move(layer), what,
                        std::move(operation), model);
}

std::string Edit::free_name(const std::string& wanted) const {
    const std::string base = wanted.empty() ? "layer" : wanted;
    std::string name = base;
    const auto taken = [&] {
        return std::ranges::any_of(layers_, [&](const SceneLayer& l) { return l.name == name; });
    };
    for (int n = 2; taken(); ++n) name = fmt::format("{} {}", base, n);
    return name;
}

std::size_t Edit::layer_named(const std::string& name) const {
    std::string names;
    for (std::size_t n = 0; n < layers_.size(); ++n) {
        if (layers_[n].name == name) return n;
        names += (n > 0 ? ", " : "") + layers_[n].name;
    }
    throw Error("layer '" + name + "'", "does not exist", "There are: " + names + ".");
}

std::vector<std::uint32_t> Edit::live_splats(const SceneLayer& layer) const {
    std::vector<std::uint32_t> splats = splats_in(layer.splats);
    std::erase_if(splats, [&](std::uint32_t i) { return removed_[i] != 0; });
    return splats;
}

std::size_t Edit::count_in(const SceneLayer& layer) const {
    return live_splats(layer).size();
}

// Swaps the lists; what is drawn in which kernel follows from the visible layers.
void Edit::swap_layers(Layered& change, SplatModel& model) {
    std::swap(change.other, layers_);
    std::ranges::fill(veiled_, std::uint8_t{0});
    for (const SceneLayer& layer : layers_)
        for (const SplatRun& range : layer.splats)
            if (!layer.visible)
                std::fill_n(veiled_.begin() + range.first, range.count, std::uint8_t{1});
    const auto seen = std::ranges::find_if(layers_, &SceneLayer::visible);
    const LayerLook look = seen != layers_.end() ? seen->look : layers_.front().look;
    const bool mixed = mixes_kernels();
    if (!(look == look_of(model)) || mixed != std::exchange(mixed_, mixed)) changed_model();
    set_look(look, model);
    ++seen_version_, ++version_;
}

std::size_t Edit::change_layers(std::vector<SceneLayer> next, std::string what, Marks marks,
                                EditOperation operation, SplatModel& model) {
    if (next == layers_) return 0;
    Step step{std::move(what), ++last_id_, {}, std::move(operation)};
    step.changes.emplace_back(std::move(marks));
    step.changes.emplace_back(Layered{std::move(next)});
    for (Change& change : step.changes) apply_change(change, true, model);
    push(std::move(step));
    return 1;
}

bool Edit::mixes_kernels() const {
    const SceneLayer* first = nullptr;
    for (const SceneLayer& layer : layers_) {
        if (!layer.visible) continue;
        if (first == nullptr) first = &layer;
        if (layer.look.kernel != first->look.kernel ||
            layer.look.footprint != first->look.footprint)
            return true;
    }
    return false;
}

std::vector<std::string> Edit::losses_together() const {
    std::vector<std::string> losses;
    std::set<int> said;
    bool with = false, without = false;
    for (const SceneLayer& layer : layers_) {
        if (!layer.visible) continue;
        (layer.look.antialias ? with : without) = true;
        const int kernel = layer.look.kernel;
        if (!mixes_kernels() || kernel == KERNEL_GAUSSIAN || !said.insert(kernel).second) continue;
        const std::string off =
            kernel_has_shape(kernel)
                ? ""
                : fmt::format(", whose profile is off by {:.2f} %",
                              100 * gaussian_equivalent(kernel, layer.look.footprint, false).error);
        losses.push_back(fmt::format(
            "The layers have different kernels: {} is drawn, and saved with others, as the nearest "
            "Gaussians{}.",
            kernel_name(kernel), off));
    }
    if (with && without)
        losses.emplace_back(
            "Some layers were trained with antialiasing (render mode mip) and some without: the "
            "first visible one decides for all.");
    return losses;
}

std::optional<SplatModel> Edit::drawn_otherwise(const SplatModel& model) const {
    if (!mixes_kernels()) {
        if (model.shape.empty() || kernel_takes(model.kernel, kShape)) return {};
        SplatModel plain = model;
        plain.shape.clear();
        return plain;
    }
    SplatModel drawn = model;
    set_kernel(drawn, KERNEL_GAUSSIAN);
    drawn.footprint = Footprint::psi;
    for (const SceneLayer& layer : layers_) {
        const std::vector<std::uint32_t> splats = splats_in(layer.splats);
        if (layer.visible)
            put_splats(splats, as_gaussians(picked(model, splats, layer.look), false), drawn);
    }
    return drawn;
}

SplatModel Edit::picked(const SplatModel& model, const std::vector<std::uint32_t>& splats,
                        const LayerLook& look) const {
    SplatModel out = pick_splats(model, splats);
    set_look(look, out);
    set_kernel(out, look.kernel);
    return out;
}

std::vector<std::uint32_t> Edit::visible_splats() const {
    std::vector<std::uint32_t> splats;
    for (const SceneLayer& layer : layers_)
        if (layer.visible) std::ranges::copy(live_splats(layer), std::back_inserter(splats));
    return splats;
}

std::size_t Edit::show_layer(const edits::ShowLayer& show, SplatModel& model) {
    const std::size_t n = layer_named(show.layer);
    std::vector<SceneLayer> next = layers_;
    next[n].visible = show.visible;
    Marks marks;
    for (const std::uint32_t i : splats_in(layers_[n].splats))
        if (!show.visible && selected_[i] != 0) marks.selected.push_back(i);
    return change_layers(
        std::move(next),
        fmt::format("{} the layer {}", show.visible ? "showed" : "hid", show.layer),
        std::move(marks), show, model);
}

std::size_t Edit::rename_layer(const edits::RenameLayer& rename, SplatModel& model) {
    const std::size_t n = layer_named(rename.layer);
    if (rename.name == rename.layer) return 0;
    if (rename.name.empty())
        throw Error("layer '" + rename.layer + "'", "needs a name", "Type one.");
    std::vector<SceneLayer> next = layers_;
    edits::RenameLayer done = rename;
    done.name = next[n].name = free_name(rename.name);
    return change_layers(std::move(next),
                         fmt::format("renamed the layer {} to {}", rename.layer, done.name), {},
                         done, model);
}

std::size_t Edit::place_layer(const edits::PlaceLayer& place, SplatModel& model) {
    const std::size_t n = layer_named(place.layer);
    std::vector<SceneLayer> next = layers_;
    SceneLayer layer = next[n];
    next.erase(next.begin() + static_cast<std::ptrdiff_t>(n));
    next.insert(next.begin() + static_cast<std::ptrdiff_t>(std::min(place.place, next.size())),
                std::move(layer));
    return change_layers(std::move(next), fmt::format("moved the layer {}", place.layer), {}, place,
                         model);
}

std::size_t Edit::remove_layer(const edits::RemoveLayer& remove, SplatModel& model) {
    const std::size_t n = layer_named(remove.layer);
    if (layers_.size() == 1)
        throw Error("layer '" + remove.layer + "'", "is the only one",
                    "Open another scene, which takes its place.");
    Marks marks = removing(set_of_ranges(layers_[n].splats, removed_.size()), true);
    std::vector<SceneLayer> next = layers_;
    next.erase(next.begin() + static_cast<std::ptrdiff_t>(n));
    return change_layers(std::move(next), fmt::format("deleted the layer {}", remove.layer),
                         std::move(marks), remove, model);
}

std::size_t Edit::merge_layers(const edits::MergeLayers& merge, SplatModel& model) {
    const std::size_t into = layer_named(merge.layer), from = layer_named(merge.with);
    if (into == from) return 0;
    if (!(layers_[into].look == layers_[from].look))
        throw Error("layer '" + merge.with + "'",
                    fmt::format("has the kernel {}, and {} has {}, or they differ in footprint or "
                                "antialiasing",
                                kernel_name(layers_[from].look.kernel), merge.layer,
                                kernel_name(layers_[into].look.kernel)),
                    "Keep two layers: they are saved together as Gaussians.");
    std::vector<SceneLayer> next = layers_;
    next[into].splats = joined_ranges(next[into].splats, next[from].splats);
    next[into].file.clear();
    next[into].moved = {};
    next[into].visible = true;
    next.erase(next.begin() + static_cast<std::ptrdiff_t>(from));
    return change_layers(std::move(next),
                         fmt::format("merged the layer {} into {}", merge.with, merge.layer), {},
                         merge, model);
}

}  // namespace darb
