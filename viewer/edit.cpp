#include "viewer/edit.h"

#include <cmath>

#include "engine/core/check.h"
#include "engine/scene/edit_splats.h"

namespace darb {

bool Region::contains(const glm::dvec3& p) const {
    const glm::dvec3 d = p - centre;
    if (shape == Shape::sphere) return glm::dot(d, d) <= half_size.x * half_size.x;
    return std::abs(d.x) <= half_size.x && std::abs(d.y) <= half_size.y &&
           std::abs(d.z) <= half_size.z;
}

size_t Edit::remove(const SplatModel& model, const Region& region, bool inside) {
    DARB_CHECK(model.size() == removed_.size(), "{} splats, {}", model.size(), removed_.size());
    std::vector<std::uint32_t> step;
    for (size_t i = 0; i < removed_.size(); ++i)
        if (removed_[i] == 0 && region.contains(position_of(model, i)) == inside)
            step.push_back(static_cast<std::uint32_t>(i));
    const size_t count = step.size();
    if (count == 0) return 0;
    steps_.resize(done_);
    if (saved_ && *saved_ > done_) saved_.reset();
    mark(step, 1);
    steps_.push_back(std::move(step));
    done_ = steps_.size();
    return count;
}

void Edit::undo() {
    if (can_undo()) mark(steps_[--done_], 0);
}

void Edit::redo() {
    if (can_redo()) mark(steps_[done_++], 1);
}

void Edit::mark(const std::vector<std::uint32_t>& splats, std::uint8_t value) {
    for (const std::uint32_t i : splats) removed_[i] = value;
    removed_count_ += value != 0 ? splats.size() : -splats.size();
}

SplatModel Edit::apply(const SplatModel& model) const {
    SplatModel out = model;
    keep_splats([&](size_t i) { return removed_[i] == 0; }, out);
    return out;
}

size_t count_inside(const SplatModel& model, const Region& region, const Edit& edit) {
    size_t count = 0;
    for (size_t i = 0; i < model.size(); ++i)
        if (edit.removed()[i] == 0 && region.contains(position_of(model, i))) ++count;
    return count;
}

}  // namespace darb
