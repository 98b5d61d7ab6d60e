// SPDX-License-Identifier: MIT
#include "engine/render/light_share.h"

#include <algorithm>

#include "engine/core/error.h"
#include "engine/render/render_gradients.h"
#include "engine/scene/edit_splats.h"

namespace darb {

namespace {

/// Red holds the chosen splats, green all of them. Over black, a picture then holds sums of T
/// alpha.
GradientRenderer flagged(Device& device, SplatModel model,
                         const std::vector<std::uint8_t>& chosen) {
    limit_sh_degree(0, model);
    for (std::size_t i = 0; i < model.size(); ++i) {
        model.sh_dc[3 * i] = chosen[i] != 0 ? 1.0f : 0.0f;
        model.sh_dc[3 * i + 1] = 1.0f;
        model.sh_dc[3 * i + 2] = 0.0f;
    }
    return {device, model, {.direct_colour = true}};
}

}  // namespace

std::vector<std::uint32_t> views_that_see(Device& device, const SplatModel& model,
                                          const std::vector<Camera>& cameras) {
    std::vector<std::uint32_t> views(model.size(), 0);
    if (model.size() == 0) return views;
    GradientRenderer renderer = flagged(device, model, std::vector<std::uint8_t>(model.size(), 1));
    for (const Camera& camera : cameras) {
        renderer.render(camera);
        ImageF green(camera.width, camera.height, 3);
        for (std::size_t i = 1; i < green.data.size(); i += 3) green.data[i] = 1;
        const ViewGradients gradients = renderer.backward(green);
        // d(sum of green) / d(green of a splat) is the splat's light.
        for (std::size_t i = 0; i < views.size(); ++i)
            views[i] += gradients.d.sh_dc[3 * i + 1] > 0 ? 1 : 0;
    }
    return views;
}

std::vector<double> light_shares(Device& device, const SplatModel& model,
                                 const std::vector<std::uint8_t>& chosen,
                                 const std::vector<Camera>& cameras) {
    DARB_CHECK(chosen.size() == model.size(), "{} flags for {} splats", chosen.size(),
               model.size());
    std::vector<double> shares(cameras.size(), 0.0);
    if (model.size() == 0) return shares;
    GradientRenderer renderer = flagged(device, model, chosen);
    for (std::size_t c = 0; c < cameras.size(); ++c) {
        const ImageF& image = renderer.render(cameras[c]);
        double part = 0, all = 0;
        for (std::size_t i = 0; i < image.data.size(); i += 3) {
            part += image.data[i];
            all += image.data[i + 1];
        }
        shares[c] = all > 0 ? part / all : 0.0;
    }
    return shares;
}

}  // namespace darb
