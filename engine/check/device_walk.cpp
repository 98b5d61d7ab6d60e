// SPDX-License-Identifier: MIT
#include "engine/check/device_walk.h"

#include "engine/core/rng.h"
#include "engine/reference/reference_render.h"
#include "engine/render/renderer.h"

namespace darb::check {

ForwardOptions forward_options(const SplatModel& model, const WalkSettings& settings) {
    ForwardOptions options;
    options.kernel = model.kernel;
    options.footprint = model.footprint;
    options.evaluation = settings.evaluation;
    options.polynomial_degree = settings.polynomial_degree;
    options.storage = settings.storage;
    options.depth_order = settings.depth_order;
    options.projection = settings.projection;
    options.arithmetic = settings.arithmetic;
    options.alpha_cutoff = settings.alpha_cutoff;
    options.transmittance_stop = settings.transmittance_stop;
    options.store_for_backward = settings.depth_order != DEPTH_ORDER_PIXEL;
    options.effects.antialias = model.antialias;
    return options;
}

std::vector<float> to_planes(const Image<double>& image) {
    const size_t pixels = image.data.size() / 3;
    std::vector<float> planes(pixels * 3);
    for (size_t i = 0; i < pixels; ++i)
        for (size_t c = 0; c < 3; ++c)
            planes[c * pixels + i] = static_cast<float>(image.data[i * 3 + c]);
    return planes;
}

DeviceWalk walk_on_device(Device& device, const SplatModel& model, const Camera& camera,
                          const Image<double>& d_image, const WalkSettings& settings) {
    ForwardOptions options = forward_options(model, settings);
    options.effects.lens = camera.lens.active;
    const int degree = std::min(settings.sh_degree, model.sh_degree);
    const GpuSplats splats(device, model, false);
    FrameBuffers buffers(device, options);
    Forward forward(device, options);
    Backward backward(device, options);
    GradientBuffers gradients(device, splats);
    FrameView view{camera_data(camera, model.origin), nullptr, 0, degree, settings.background};
    const Buffer cameras = upload_cameras(device, {view.camera});
    view.cameras = &cameras;
    Frame& frame = buffers.frame();
    const size_t floats = size_t(camera.width) * camera.height * 3;
    Buffer d_planes(device, "d_image", floats * sizeof(float));
    if (!d_image.data.empty()) d_planes.upload(to_planes(d_image));
    buffers.reserve(splats.count(), settings.intersections, camera.width, camera.height);

    Commands commands(device);
    DeviceWalk walk;
    for (;;) {
        if (!d_image.data.empty()) backward.reserve(splats.count(), frame.size.intersections);
        commands.begin();
        forward.record(commands, splats, view, frame);
        if (!d_image.data.empty())
            backward.record_gradients(commands, view, frame, splats, d_planes, {gradients});
        commands.submit_and_wait();
        walk.status = frame.read_status();
        if (!buffers.make_room(walk.status)) break;
    }
    walk.image =
        planes_to_image(frame.images.image.download<float>(floats), camera.width, camera.height);
    if (splats.count() > 0)
        walk.intersection_count =
            frame.splats.intersection_count.download<std::uint32_t>(splats.count());
    if (d_image.data.empty()) return walk;
    for (int a = 0; a < kAttributeCount; ++a) walk.d[a] = gradients.download(a);
    const auto sums = gradients.views().download<float>(size_t{splats.count()} * 2);
    for (size_t i = 0; i < splats.count(); ++i) walk.mean_gradient_ndc.push_back(sums[2 * i]);
    return walk;
}

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
