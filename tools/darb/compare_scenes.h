// How far two scenes differ in pictures.
#pragma once

#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/scene/splat_model.h"

namespace darb {

struct SceneDifference {
    double mean_psnr_db = 0, worst_psnr_db = 0;
    std::string worst_view;
};

/// "41.20 dB mean over 8 views, 38.10 dB at worst (view 3)".
std::string difference_text(const SceneDifference& difference, std::size_t views);

/// Eight views around the splats, 480 x 360. Throws Error where there are none.
std::vector<View> views_around(const SplatModel& scene);

/// Renders both on the device (select: number or part of a name) over black. Equal pictures count
/// as 100 dB.
SceneDifference compare_scenes(const SplatModel& scene, const SplatModel& other,
                               const std::vector<View>& views, const std::string& device);

}  // namespace darb
