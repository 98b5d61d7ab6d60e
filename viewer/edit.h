// SPDX-License-Identifier: MIT
// Edit: what was done to a scene since it was opened, step by step, with undo and redo. Splats can
// be selected, hidden, deleted and moved, scenes can be merged into the scene, and facts about it
// can be stated. Marks and facts lie beside the model; moves and merges change the model, which the
// caller keeps and hands over. It must always be the same one.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "engine/scene/camera.h"
#include "engine/scene/clutter.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/region.h"
#include "engine/scene/splat_model.h"
#include "viewer/measure.h"

namespace darb {

/// a and b are opposite corners, px.
SplatSet in_rectangle(const SplatModel& model, const Camera& camera, glm::dvec2 a, glm::dvec2 b);
/// The outline in px; its ends are joined, and the even-odd rule decides what is inside.
SplatSet in_lasso(const SplatModel& model, const Camera& camera,
                  const std::vector<glm::dvec2>& lasso);
/// Splats within the radius of the line through the points, px.
SplatSet under_brush(const SplatModel& model, const Camera& camera,
                     const std::vector<glm::dvec2>& stroke, double radius);
SplatSet in_region(const SplatModel& model, const Region& region);
/// By opacity, 0 to 1.
SplatSet by_opacity(const SplatModel& model, double low, double high);
/// By the largest standard deviation, world units.
SplatSet by_scale(const SplatModel& model, double low, double high);
/// By colour without harmonics above degree 0; all channels must be within the tolerance, sRGB 0 to
/// 1.
SplatSet by_colour(const SplatModel& model, const glm::dvec3& colour, double tolerance);
/// The base colour, sRGB, not clamped.
glm::dvec3 base_colour(const SplatModel& model, std::size_t splat);
/// Adds all splats nearer than `distance` (world units, above 0) to one of the mask.
SplatSet grown(const SplatModel& model, const SplatSet& mask, double distance);

/// How a new selection is combined with the one before.
enum class Combine { replace, add, subtract };

class Edit {
  public:
    /// metres_per_unit: of the scene as it was opened; 0: not known.
    explicit Edit(std::size_t splats = 0, double metres_per_unit = 0)
        : removed_(splats, 0), hidden_(splats, 0), selected_(splats, 0) {
        facts_.metres_per_unit = metres_per_unit;
    }

    // Each of these is a step unless it changes nothing. They return how many splats changed.
    // Hidden and deleted splats are never selected.
    std::size_t select(const SplatSet& mask, Combine how);
    std::size_t invert_selection();
    std::size_t remove(const SplatSet& mask);
    std::size_t remove_selected() { return remove(selected_); }
    std::size_t hide_selected();
    std::size_t show_hidden();
    /// Deletes the splats whose mean is inside the region (or outside: a crop).
    std::size_t remove(const SplatModel& model, const Region& region, bool inside);

    /// While a hand drags, the selection moves, or everything where nothing is selected; `total`
    /// counts from begin_transform. end_transform turns the drag into one step, and
    /// cancel_transform drops it. After cancel_transform and after an undo the model is as it was,
    /// bit by bit.
    void begin_transform(const SplatModel& model);
    void drag_transform(const Similarity& total, SplatModel& model);
    std::size_t end_transform(const SplatModel& model);
    void cancel_transform(SplatModel& model);
    bool transforms() const { return dragged_.has_value(); }
    /// Appends the splats of another scene and selects only those. Throws Error where one model
    /// cannot hold both: the kernels differ, or only one has some attribute. Harmonics of the
    /// lesser degree get zeros.
    std::size_t merge(SplatModel added, SplatModel& model);

    /// What is known of the scene besides its splats.
    const SceneFacts& facts() const { return facts_; }
    /// One step, which replaces the facts. what: what it did, for messages; content: whether a
    /// saved file would differ. Returns 0 where they are the same, else 1.
    std::size_t state(const SceneFacts& facts, std::string what, bool content);
    /// Says which way is up without a step, so that undoing a ground leads back there.
    void note_up(const glm::dvec3& up) { facts_.up = up; }

    /// Counts of splats: of the scene as it was opened, then of each scene merged into it, in
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
    /// Deleted or hidden, [N].
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
    /// The scene without the deleted splats, in the same order, with the unit of the facts.
    SplatModel apply(const SplatModel& model) const;

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
        std::vector<std::uint32_t> selected;  // the selection before
    };
    struct Stated {
        SceneFacts other;  // before a step that is done, else after it
    };
    struct Step {
        std::string what;
        int id = 0;  // the content from here on; 0: as before
        std::variant<Marks, Moved, Merged, Stated> change;
    };
    void push(Step step);
    std::size_t mark(const char* verb, Marks marks, bool content);
    void flip(const Marks& marks);
    void apply_step(Step& step, bool forward, SplatModel& model);
    void append(const Merged& merged, SplatModel& model);
    void cut(const Merged& merged, SplatModel& model);
    std::vector<std::uint32_t> moved_splats() const;
    void changed_model() { ++model_version_, ++seen_version_, ++version_; }

    SplatSet removed_, hidden_, selected_;
    SceneFacts facts_;
    std::vector<Step> steps_;
    std::size_t done_ = 0;  // how many of steps_ are done
    std::size_t removed_count_ = 0, hidden_count_ = 0, selected_count_ = 0;
    std::optional<Moved> dragged_;  // `other` holds the state before
    bool was_dragged_ = false;
    int last_id_ = 0, model_version_ = 0, seen_version_ = 0, version_ = 0;
    int saved_ = 0;  // content when it was saved; 0: that of the file
};

}  // namespace darb
