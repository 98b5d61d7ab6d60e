// SPDX-License-Identifier: MIT
#include "engine/data/region.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace darb {

// Least squares point of the optical axes: sum (I - d d^T) x = sum (I - d d^T) c.
Region region_in_view(const Dataset& dataset) {
    std::vector<View> views;
    for (const View& v : dataset.views)
        if (!v.is_test) views.push_back(v);
    glm::dmat3 normal(0.0);
    glm::dvec3 right(0.0), low(1e300), high(-1e300);
    for (const View& v : views) {
        const glm::dvec3 c = v.camera.centre();
        const glm::dvec3 axis = glm::transpose(v.camera.rotation)[2];
        const glm::dmat3 across = glm::dmat3(1.0) - glm::outerProduct(axis, axis);
        normal += across;
        right += across * c;
        low = glm::min(low, c);
        high = glm::max(high, c);
    }
    const double scale = static_cast<double>(views.size());
    if (std::abs(glm::determinant(normal)) > 1e-3 * scale * scale * scale) {
        const glm::dvec3 focus = glm::inverse(normal) * right;
        double half = 0.0;
        for (const View& v : views) {
            const double view_half =
                0.5 * std::min(v.camera.width / v.camera.fx, v.camera.height / v.camera.fy);
            half += glm::length(v.camera.centre() - focus) * view_half;
        }
        return {focus, glm::dvec3(half / scale)};
    }
    return {0.5 * (low + high), glm::max(0.5 * (high - low), glm::dvec3(scene_extent(dataset)))};
}

}  // namespace darb
