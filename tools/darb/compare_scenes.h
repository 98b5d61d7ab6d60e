// How far two scenes differ in pictures: cameras around a scene, and PSNR of the one against the
// other.
#pragma once

#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// Eight views, 480 x 360 px and 50 degrees wide, that look from 20 degrees above at the middle of
/// the splats, near enough for 98 % of them to fill the frame.
std::vector<View> orbit_views(const SplatModel& model);

struct SceneDifference {
    double mean_psnr_db = 0, worst_psnr_db = 0;
    std::string worst_view;
};

/// Renders both on the device (select: number or part of a name) over black. Equal pictures count
/// as 100 dB.
SceneDifference compare_scenes(const SplatModel& scene, const SplatModel& other,
                               const std::vector<View>& views, const std::string& device);

}  // namespace darb
