// SPDX-License-Identifier: MIT
// Edit: what was done to a scene since it was opened, step by step, with undo and redo. Splats can
// be selected, hidden, deleted and moved; scenes can be added as layers, which can be hidden,
// moved, copied, ordered and merged; and facts about the scene can be stated. Marks, layers and
// facts lie beside the model; moves and added layers change the model, which the caller keeps and
// hands over. It must always be the same one.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "engine/scene/clutter.h"
#include "engine/scene/edit_operation.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/measure.h"
#include "engine/scene/select.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// How the splats of a layer are meant to be drawn.
struct LayerLook {
    int kernel = KERNEL_GAUSSIAN;
    Footprint footprint = Footprint::psi;
    bool antialias = false;
    bool operator==(const LayerLook&) const = default;
};
LayerLook look_of(const SplatModel& model);

/// A part of the scene that can be hidden, moved and saved by itself.
struct SceneLayer {
    std::string name;            // no two layers have one name
    std::filesystem::path file;  // from which it was added; empty: another layer, or not known
    bool visible = true;
    LayerLook look;
    Similarity moved;              // how it was moved as a whole since it was added
    std::vector<SplatRun> splats;  // ascending
    bool operator==(const SceneLayer&) const = default;
};

/// Reads a scene that an operation names. Throws Error.
using ReadScene = std::function<SplatModel(const std::filesystem::path&)>;

class Edit {
  public:
    /// A scene of one layer, in the look of a Gaussian. metres_per_unit: of the scene as it was
    /// opened; 0: not known.
    explicit Edit(std::size_t splats = 0, double metres_per_unit = 0);
    /// The same with the look and the unit of the model.
    Edit(const SplatModel& model, std::string name, std::filesystem::path file);

    /// Does what the operation says, in one step unless it changes nothing. Returns how many splats
    /// changed, or 1 for a change of layers or facts. read: for operations that add scenes. Throws
    /// Error where it cannot be done; everything is then as it was.
    std::size_t perform(const EditOperation& operation, SplatModel& model,
                        const ReadScene& read = {});
    /// What was done, step by step: performed on the scene as it was opened, in this order, this
    /// gives the same model and marks, bit by bit.
    std::vector<EditOperation> operations() const;

    // Each of these is a step unless it changes nothing. They return how many splats changed.
    // Hidden and deleted splats are never selected, nor are those of a hidden layer; these are not
    // deleted with others either.
    std::size_t select(const SplatSet& mask, Combine how);
    std::size_t invert_selection();
    std::size_t remove(const SplatSet& mask);
    std::size_t remove_selected();
    std::size_t hide_selected();
    std::size_t show_hidden();
    /// Deletes the splats whose mean is inside the region (or outside: a crop).
    std::size_t remove(const SplatModel& model, const Region& region, bool inside);
    /// Which splats a selector means, hidden and deleted ones too. Throws Error for a layer that
    /// does not exist.
    SplatSet meant(const Selector& what, const SplatModel& model) const;

    /// While a hand drags, the selection moves, or everything where nothing is selected; `total`
    /// counts from begin_transform. end_transform turns the drag into one step, and
    /// cancel_transform drops it. After cancel_transform and after an undo the model is as it was,
    /// bit by bit.
    void begin_transform(const SplatModel& model);
    void drag_transform(const Similarity& total, SplatModel& model);
    std::size_t end_transform(const SplatModel& model);
    void cancel_transform(SplatModel& model);
    bool transforms() const { return dragged_.has_value(); }
    /// Adds the splats of another scene as a layer and selects only those. Harmonics of the lesser
    /// degree get zeros. source: its file and name; the name is changed where another layer has it.
    std::size_t merge(SplatModel added, SplatModel& model, const edits::Add& source = {});

    /// In the order of the list, at least one.
    const std::vector<SceneLayer>& layers() const { return layers_; }
    /// Throws Error where no layer has this name.
    std::size_t layer_named(const std::string& name) const;
    /// How many splats of a layer are not deleted.
    std::size_t count_in(const SceneLayer& layer) const;
    /// Whether the visible layers have more than one kernel or footprint. They are then drawn and
    /// saved together as Gaussians.
    bool mixes_kernels() const;
    /// What is lost where visible layers are drawn or saved together, a sentence each.
    std::vector<std::string> losses_together() const;
    /// The model as it is drawn, where that is not the model itself: where layers mix kernels, or
    /// only hidden ones have shapes.
    std::optional<SplatModel> drawn_otherwise(const SplatModel& model) const;

    /// What is known of the scene besides its splats.
    const SceneFacts& facts() const { return facts_; }
    /// One step, which replaces the facts. what: what it did, for messages; content: whether a
    /// saved file would differ. Returns 0 where they are the same, else 1.
    std::size_t state(const SceneFacts& facts, std::string what, bool content);
    /// Says which way is up without a step, so that undoing a ground leads back there.
    void note_up(const glm::dvec3& up) { facts_.up = up; }
    /// Measurements and notes that a project brings, without a step.
    void note_measured(Measurement measured, std::vector<SceneNote> notes);

    /// Counts of splats: of the scene as it was opened, then of each scene or copy added to it, in
    /// order.
    std::vector<std::size_t> parts() const;

    bool can_undo() const { return done_ > 0; }
    bool can_redo() const { return done_ < steps_.size(); }
    /// Returns what was undone or redone, such as "deleted 12 splats"; "" where there was nothing
    /// to do.
    std::string undo(SplatModel& model);
    /// Undoes the last step so that it cannot be redone either.
    void take_back(SplatModel& model);
    std::string redo(SplatModel& model);
    /// What the last step did.
    const std::string& last() const;
    /// Grows with each change of the model itself, undone ones too.
    int model_version() const { return model_version_; }
    /// Grows with each change that is visible without the highlight of a selection.
    int seen_version() const { return seen_version_; }
    /// Grows with each change of anything.
    int version() const { return version_; }

    const SplatSet& removed() const { return removed_; }    // [N]
    const SplatSet& selected() const { return selected_; }  // [N]
    /// Deleted or hidden, or of a hidden layer, [N].
    SplatSet unseen() const;
    std::size_t removed_count() const { return removed_count_; }
    std::size_t hidden_count() const { return hidden_count_; }
    std::size_t selected_count() const { return selected_count_; }
    /// Identifies the content: equal where the saved file would be equal; 0: as it was opened.
    int content() const;
    /// Whether the saved file would differ from the original and from the last mark_saved().
    /// Selections and hidden splats are not saved.
    bool unsaved() const;
    void mark_saved() { saved_ = content(); }
    /// The visible layers together, in their order, without the deleted splats, with the unit of
    /// the facts.
    SplatModel apply(const SplatModel& model) const;
    /// One layer alone, also a hidden one, in its own kernel.
    SplatModel apply(const SplatModel& model, const SceneLayer& layer) const;

  private:
    struct Marks {  // each mask lists the splats whose mark changes
        std::vector<std::uint32_t> removed, hidden, selected;
    };
    struct Moved {
        std::vector<std::uint32_t> splats;
        SplatModel other;  // the splats' other state: before a step that is done, else after it
    };
    struct Merged {
        SplatModel added;
        int degree = 0;                       // the model's degree before
        bool shapes = false;                  // whether the model had shapes before
        std::vector<std::uint32_t> selected;  // the selection before
    };
    struct Stated {
        SceneFacts other;  // before a step that is done, else after it
    };
    struct Layered {
        std::vector<SceneLayer> other;  // before a step that is done, else after it
    };
    using Change = std::variant<Marks, Moved, Merged, Stated, Layered>;
    struct Step {
        std::string what;
        int id = 0;  // the content from here on; 0: as before
        std::vector<Change> changes;
        std::optional<EditOperation> operation;  // nothing: none of a script, as a measured point
    };
    void push(Step step);
    std::size_t mark(const char* verb, Marks marks, bool content, EditOperation operation);
    std::size_t select(const SplatSet& mask, Combine how, EditOperation operation);
    std::size_t remove(const SplatSet& mask, EditOperation operation);
    Marks removing(const SplatSet& mask, bool veiled_too) const;
    std::size_t transform(const edits::Transform& move, SplatModel& model);
    std::size_t duplicate(const edits::Duplicate& copy, SplatModel& model);
    std::size_t show_layer(const edits::ShowLayer& show, SplatModel& model);
    std::size_t rename_layer(const edits::RenameLayer& rename, SplatModel& model);
    std::size_t place_layer(const edits::PlaceLayer& place, SplatModel& model);
    std::size_t remove_layer(const edits::RemoveLayer& remove, SplatModel& model);
    std::size_t merge_layers(const edits::MergeLayers& merge, SplatModel& model);
    std::size_t change_layers(std::vector<SceneLayer> next, std::string what, Marks marks,
                              EditOperation operation, SplatModel& model);
    std::size_t append_layer(SplatModel added, SceneLayer layer, std::string what,
                             EditOperation operation, SplatModel& model);
    std::string free_name(const std::string& wanted) const;
    std::vector<std::uint32_t> live_splats(const SceneLayer& layer) const;
    std::vector<std::uint32_t> visible_splats() const;
    void swap_layers(Layered& change, SplatModel& model);
    void begin_transform(const SplatModel& model, std::vector<std::uint32_t> splats);
    std::size_t end_transform(const SplatModel& model, const std::string& layer);
    std::vector<SceneLayer> layers_after_move(const std::vector<std::uint32_t>& splats) const;
    void flip(const Marks& marks);
    void apply_change(Change& change, bool forward, SplatModel& model);
    void append(const Merged& merged, SplatModel& model);
    void cut(const Merged& merged, SplatModel& model);
    std::vector<std::uint32_t> moved_splats() const;
    SplatModel picked(const SplatModel& model, const std::vector<std::uint32_t>& splats,
                      const LayerLook& look) const;
    EarthPlace stated_place(const SplatModel& model) const;
    void changed_model() { ++model_version_, ++seen_version_, ++version_; }

    SplatSet removed_, hidden_, selected_;
    SplatSet veiled_;  // [N] of a hidden layer
    std::vector<SceneLayer> layers_;
    bool mixed_ = false;  // mixes_kernels() of these
    SceneFacts facts_;
    std::vector<Step> steps_;
    std::size_t done_ = 0;  // how many of steps_ are done
    std::size_t removed_count_ = 0, hidden_count_ = 0, selected_count_ = 0;
    std::optional<Moved> dragged_;    // `other` holds the state before
    std::optional<Similarity> drag_;  // the last total of the drag
    int last_id_ = 0, model_version_ = 0, seen_version_ = 0, version_ = 0;
    int saved_ = 0;  // content when it was saved; 0: that of the file
};

}  // namespace darb
