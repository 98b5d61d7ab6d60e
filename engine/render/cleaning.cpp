// SPDX-License-Identifier: MIT
#include "engine/render/cleaning.h"

#include <numeric>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/parse_number.h"
#include "engine/render/free_space.h"
#include "engine/render/light_share.h"

namespace darb {

namespace {

constexpr int kLightWidth = 480;  // px, of the pictures whose light is measured

struct Asked {
    Device& device;
    const SplatModel& model;
    const std::vector<Camera>& cameras;  // as they are
    std::vector<Camera> small;           // no wider than kLightWidth
};

double light_of(const Asked& asked, const SplatSet& set) {
    if (count_of(set) == 0 || asked.small.empty()) return 0;
    const std::vector<double> shares = light_shares(asked.device, asked.model, set, asked.small);
    return std::accumulate(shares.begin(), shares.end(), 0.0) / double(shares.size());
}

SplatSet in_free_space(const Asked& asked, std::uint32_t least_views, Renderer& renderer,
                       const std::function<void(double)>& progress) {
    FreeSpaceOptions options;
    options.least_views = least_views;
    FreeSpace space(asked.model, options);
    for (std::size_t v = 0; v < asked.cameras.size(); ++v) {
        if (progress) progress(double(v) / double(asked.cameras.size()));
        space.ask(renderer, asked.cameras[v]);
    }
    return space.splats();
}

SplatSet seen_by_few(const Asked& asked, std::uint32_t fewest) {
    const std::vector<std::uint32_t> views = views_that_see(asked.device, asked.model, asked.small);
    SplatSet few(asked.model.size());
    for (std::size_t i = 0; i < few.size(); ++i) few[i] = views[i] > 0 && views[i] < fewest ? 1 : 0;
    return few;
}

}  // namespace

void take_haze(const std::string& option, const std::string& text, CleaningRules& rules) {
    const std::vector<double> haze = numbers_from(option, text, 2);
    if (!(haze[0] >= 0 && haze[0] <= 1 && haze[1] > 0))
        throw Error(option + " " + text, "is not an opacity and a size",
                    "Give an opacity of 0 to 1 and how many times the median size, as " + option +
                        " 0.1,5.");
    rules.haze_opacity = haze[0];
    rules.haze_size = haze[1];
}

Clutter find_clutter(Device& device, const SplatModel& model, const std::vector<Camera>& cameras,
                     const CleaningRules& rules,
                     const std::function<std::unique_ptr<Renderer>()>& renderer,
                     const std::function<void(double)>& progress) {
    Asked asked{device, model, cameras, {}};
    for (const Camera& camera : cameras)
        asked.small.push_back(pinhole_at_most(camera, kLightWidth));
    Clutter found;
    const auto add = [&](const char* rule, SplatSet set) {
        found.rules.push_back({rule, std::move(set)});
    };
    if (rules.region) add("outside the region", splats_outside(*rules.region, model));
    if (rules.isolated > 0) add("isolated parts", isolated_splats(model, rules.isolated));
    if (rules.haze_size > 0) add("haze", hazy_splats(model, rules.haze_opacity, rules.haze_size));
    if (rules.free_space > 0)
        add("in free space", in_free_space(asked, rules.free_space, *renderer(), progress));
    if (rules.few_views > 0) add("seen by few", seen_by_few(asked, rules.few_views));
    found.together = {"together", SplatSet(model.size(), 0)};
    for (ClutterOfRule& rule : found.rules) {
        rule.light = light_of(asked, rule.set);
        for (std::size_t i = 0; i < rule.set.size(); ++i) found.together.set[i] |= rule.set[i];
    }
    found.together.light =
        found.rules.size() == 1 ? found.rules[0].light : light_of(asked, found.together.set);
    return found;
}

}  // namespace darb
