// Edit: which splats of a scene were deleted, by box or sphere, with undo and redo. The scene's
// arrays stay as they are until a copy without the deleted splats is asked for.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "engine/scene/splat_model.h"

namespace darb {

/// A box along the world's axes, or a sphere.
struct Region {
    enum class Shape { box, sphere };
    Shape shape = Shape::box;
    glm::dvec3 centre{0.0};     // world
    glm::dvec3 half_size{1.0};  // world; of a sphere x is the radius
    bool contains(const glm::dvec3& p) const;
};

class Edit {
  public:
    explicit Edit(size_t splats = 0) : removed_(splats, 0) {}

    /// Deletes the splats whose mean is inside the region (or outside: a crop). Returns how many;
    /// an edit that deletes nothing is not remembered. model: the scene, with as many splats.
    size_t remove(const SplatModel& model, const Region& region, bool inside);
    bool can_undo() const { return done_ > 0; }
    bool can_redo() const { return done_ < steps_.size(); }
    void undo();
    void redo();

    const std::vector<std::uint8_t>& removed() const { return removed_; }  // [N] 0 or 1
    size_t removed_count() const { return removed_count_; }
    /// Some splats are deleted, and not as they were at the last mark_saved().
    bool unsaved() const { return removed_count_ > 0 && saved_ != done_; }
    void mark_saved() { saved_ = done_; }
    /// The scene without the deleted splats, in the same order.
    SplatModel apply(const SplatModel& model) const;

  private:
    void mark(const std::vector<std::uint32_t>& splats, std::uint8_t value);
    std::vector<std::uint8_t> removed_;
    std::vector<std::vector<std::uint32_t>> steps_;  // splats that each step deleted
    size_t done_ = 0;                                // of steps_
    size_t removed_count_ = 0;
    std::optional<size_t> saved_;  // done_ when it was saved; none once that step is gone
};

/// Splats of the region that are not deleted yet.
size_t count_inside(const SplatModel& model, const Region& region, const Edit& edit);

}  // namespace darb
