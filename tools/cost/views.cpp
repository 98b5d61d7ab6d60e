// SPDX-License-Identifier: MIT
#include "tools/cost/views.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/scene/orbit_cameras.h"

namespace darb {

CostViews dataset_views(const Dataset& dataset, size_t most) {
    std::vector<View> all = held_out_views(dataset.views);
    if (all.empty()) all = dataset.views;
    const auto in_arc = [](const View& view) { return view.in_arc; };
    if (!std::all_of(all.begin(), all.end(), in_arc)) std::erase_if(all, in_arc);
    CostViews views;
    views.alpha_is_mask = dataset.alpha_is_mask;
    const size_t count = std::min(most, all.size());
    for (size_t i = 0; i < count; ++i) {
        const View& view = all[i * all.size() / count];
        views.cameras.push_back(view.camera);
        views.names.push_back(view.name);
        views.photos.push_back(load_photo(view));
    }
    return views;
}

CostViews orbit_views(const SplatModel& model, int count, int width, int height) {
    CostViews views;
    views.cameras = orbit_cameras(model, count, width, height);
    for (int v = 0; v < count; ++v) views.names.push_back(fmt::format("orbit {}", v + 1));
    return views;
}

}  // namespace darb
