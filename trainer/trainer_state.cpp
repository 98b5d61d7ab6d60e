#include "trainer/trainer_state.h"

#include <algorithm>

#include "engine/raster/gpu_splats.h"

namespace darb {

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
