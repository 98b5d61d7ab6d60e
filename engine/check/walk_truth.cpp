#include "engine/check/walk_truth.h"

#include "engine/core/rng.h"
#include "engine/reference/reference_render.h"

namespace darb::check {

namespace {

template <class T>
std::vector<double> widened(const std::vector<T>& values) {
    return {values.begin(), values.end()};
}

template <class T>
WalkTruth walk(const SplatModel& model, const Camera& camera, const Image<double>& d_image,
               const WalkSettings& settings) {
    reference::RenderSettings raster;
    for (int c = 0; c < 3; ++c) raster.background[c] = settings.background[c];
    raster.near_z = static_cast<float>(NEAR_DEFAULT);
    raster.sh_degree = settings.sh_degree;
    raster.alpha_cutoff = settings.alpha_cutoff;
    raster.transmittance_stop = settings.transmittance_stop;
    Camera local = camera;
    local.translation += camera.rotation * model.origin;
    const reference::Splats<T> splats = reference::make_splats<T>(model);
    const auto result = reference::render(splats, local, raster);
    WalkTruth truth;
    truth.image = widened(result.images.colour.data);
    truth.visible = result.visible_count();
    if (d_image.data.empty()) return truth;
    Image<T> d(d_image.width, d_image.height, d_image.channels);
    d.data.assign(d_image.data.begin(), d_image.data.end());
    const auto g = reference::backward(splats, local, raster, result, d);
    for (int a = 0; a < kAttributeCount; ++a)
        truth.d[static_cast<size_t>(a)] = widened(attribute_values(g.splats, a));
    truth.mean_gradient_ndc = widened(g.mean_gradient_ndc);
    return truth;
}

}  // namespace

WalkTruth walk_in_double(const SplatModel& model, const Camera& camera,
                         const Image<double>& d_image, const WalkSettings& settings) {
    return walk<double>(model, camera, d_image, settings);
}

WalkTruth walk_in_float(const SplatModel& model, const Camera& camera, const Image<double>& d_image,
                        const WalkSettings& settings) {
    return walk<float>(model, camera, d_image, settings);
}

Image<double> random_weights(const Camera& camera) {
    Pcg32 random(3);
    Image<double> weights(camera.width, camera.height, 3);
    for (double& w : weights.data) w = static_cast<float>(random.uniform(-1, 1));
    return weights;
}

}  // namespace darb::check
