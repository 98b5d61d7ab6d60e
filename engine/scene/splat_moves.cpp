// SPDX-License-Identifier: MIT
#include "engine/scene/splat_moves.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

namespace darb {

glm::dmat3 turn_to_up(const glm::dvec3& up) {
    const glm::dvec3 to(0, -1, 0);
    glm::dvec3 axis = glm::cross(up, to);
    const double sine = glm::length(axis);
    // a half turn where the directions are opposite
    axis = sine > 1e-12 ? axis / sine : glm::dvec3(1, 0, 0);
    return glm::dmat3(glm::rotate(glm::dmat4(1.0), std::atan2(sine, glm::dot(up, to)), axis));
}

void put_splats(const std::vector<std::uint32_t>& splats, const SplatModel& part,
                SplatModel& model) {
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::vector<float>& from = attribute_values(part, a);
        std::vector<float>& to = attribute_values(model, a);
        const std::size_t floats = model.floats(a);
        for (std::size_t i = 0; i < splats.size(); ++i)
            std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(i * floats), floats,
                        to.begin() + static_cast<std::ptrdiff_t>(splats[i] * floats));
    }
}

}  // namespace darb
