// SPDX-License-Identifier: MIT
#include "trainer/step/trainer_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "engine/core/error.h"
#include "engine/scene/splat_model.h"

namespace darb {

void check_state(const TrainerState& state) {
    const SplatModel& model = state.model;
    check_splat_shapes(model);
    const auto check = [](const std::string& what, std::size_t held, std::size_t wanted,
                          bool may_lack) {
        if (held != wanted && !(may_lack && held == 0))
            throw Error("training state",
                        fmt::format("{}: {} values instead of {}", what, held, wanted),
                        "Restore what state() gave.");
    };
    check("lists of moments", state.moments.size(), kAttributeCount, false);
    check("lists of the mean", state.mean.size(), kAttributeCount, true);
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::size_t values = attribute_values(model, a).size();
        const std::string name = attribute_name(a);
        check("moments of " + name, state.moments[a].size(), 2 * values, true);
        if (!state.mean.empty()) check("mean of " + name, state.mean[a].size(), values, false);
    }
    check("smoothing", state.smoothing.size(), model.size(), true);
    check("sum of sh_rest", state.rest_sum.size(), model.sh_rest.size(), true);
    check("profile", state.profile.size(), kProfileFloats, true);
    check("sum of gradients", state.gradient_sum.size(), 2 * model.size(), true);
}

void set_degree(TrainerState& state, int degree) {
    SplatModel& model = state.model;
    const auto before = static_cast<std::size_t>(model.rest_count());
    model.sh_degree = degree;
    const auto after = static_cast<std::size_t>(model.rest_count());
    const auto widen = [&](const std::vector<float>& from, std::size_t each) {
        std::vector<float> to(model.size() * after * each, 0.0f);
        for (std::size_t i = 0; i < model.size(); ++i)
            std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(i * before * each),
                        std::min(before, after) * each,
                        to.begin() + static_cast<std::ptrdiff_t>(i * after * each));
        return to;
    };
    model.sh_rest = widen(model.sh_rest, 1);
    state.moments[kShRest] = widen(state.moments[kShRest], 2);
    // Where there is none yet, the splats begin with zeros.
    if (!state.rest_sum.empty()) state.rest_sum = widen(state.rest_sum, 1);
    state.mean.clear();
    state.averaged = 0;
}

}  // namespace darb
