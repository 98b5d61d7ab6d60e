#include "engine/check/walk_truth.h"

#include "engine/core/rng.h"
#include "engine/reference/render.h"

namespace darb::check {

WalkTruth walk_in_double(const SplatModel& model, const Camera& camera,
                         const Image<double>& d_image, const WalkSettings& settings) {
    reference::RenderSettings raster;
    for (int c = 0; c < 3; ++c) raster.background[c] = settings.background[c];
    raster.near_z = static_cast<float>(NEAR_DEFAULT);
    raster.sh_degree = settings.sh_degree;
    raster.alpha_cutoff = settings.alpha_cutoff;
    raster.transmittance_stop = settings.transmittance_stop;
    Camera local = camera;
    local.translation += camera.rotation * model.origin;
    const reference::RenderResult result = reference::render(model, local, raster);
    WalkTruth truth;
    truth.image = result.images.colour.data;
    truth.visible = result.visible_count();
    if (d_image.data.empty()) return truth;
    const reference::Gradients g = reference::backward(model, local, raster, result, d_image);
    truth.d = {g.splats.position, g.splats.log_scale, g.splats.rotation,
               g.splats.opacity,  g.splats.sh_dc,     g.splats.sh_rest};
    truth.mean_gradient_ndc = g.mean_gradient_ndc;
    return truth;
}

Image<double> random_weights(const Camera& camera) {
    Pcg32 random(3);
    Image<double> weights(camera.width, camera.height, 3);
    for (double& w : weights.data) w = static_cast<float>(random.uniform(-1, 1));
    return weights;
}

}  // namespace darb::check
