// Where the cameras of a data set look.
#pragma once

#include <glm/glm.hpp>

#include "engine/data/dataset.h"

namespace darb {

struct Region {
    glm::dvec3 centre;  // world
    glm::dvec3 half;    // of its sides
};

/// Of the training views: the cube around the point that their optical axes come closest to, as
/// wide as the photos show there, or the box of the cameras where the axes are parallel.
Region region_in_view(const Dataset& dataset);

}  // namespace darb
