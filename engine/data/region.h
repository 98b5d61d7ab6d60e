// SPDX-License-Identifier: MIT
// Where the cameras of a data set look.
#pragma once

#include <glm/glm.hpp>

#include "engine/data/dataset.h"

namespace darb {

struct Region {
    glm::dvec3 centre;  // world
    glm::dvec3 half;    // half the lengths of the sides, world units
};

/// The cube around the point that the optical axes of the training views come closest to, as wide
/// as the photos show there; where the axes are parallel, the bounding box of the cameras.
Region region_in_view(const Dataset& dataset);

}  // namespace darb
