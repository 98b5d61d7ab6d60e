// SPDX-License-Identifier: MIT
// Moves of splats that follow one another, and splats that are put back where they were.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_model.h"

namespace darb {

inline bool operator==(const Similarity& a, const Similarity& b) {
    return a.scale == b.scale && a.turn == b.turn && a.translation == b.translation;
}
/// `first`, followed by `then`.
inline Similarity followed_by(const Similarity& first, const Similarity& then) {
    return {then.scale * first.scale, then.turn * first.turn,
            then.scale * (then.turn * first.translation) + then.translation};
}
inline Similarity inverse(const Similarity& s) {
    const glm::dmat3 back = glm::transpose(s.turn);
    return {1 / s.scale, back, -(back * s.translation) / s.scale};
}

/// The shortest turn of the world that takes `up`, a unit vector, to -y.
glm::dmat3 turn_to_up(const glm::dvec3& up);

/// Puts the splats of `part`, which has the attributes of the model, in place of these splats of
/// it.
void put_splats(const std::vector<std::uint32_t>& splats, const SplatModel& part,
                SplatModel& model);

}  // namespace darb
