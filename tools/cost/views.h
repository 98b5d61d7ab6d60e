// SPDX-License-Identifier: MIT
// The views that `darb cost` measures on: those of a data set, with their photos, or eight around
// the splats.
#pragma once

#include <vector>

#include "engine/core/image.h"
#include "engine/data/dataset.h"
#include "engine/scene/splat_model.h"

namespace darb {

struct CostViews {
    std::vector<Camera> cameras;
    std::vector<std::string> names;
    std::vector<ImageU8> photos;  // RGBA, as load_photo gives them; empty without a data set
    bool alpha_is_mask = false;
};

/// Up to `most` test views, evenly picked, or of all views where none is held out. Views of an arc
/// are taken only where there are no others. Loads the photos.
CostViews dataset_views(const Dataset& dataset, size_t most);

/// `count` cameras on a circle that look slightly down (y is down) at the splats' centre, from far
/// enough away to have nine tenths of the opacity in the picture. The model must have at least one
/// splat.
CostViews orbit_views(const SplatModel& model, int count, int width, int height);

}  // namespace darb
