// One forward and backward pass of a scene on the device, read back.
#pragma once

#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/render/backward.h"
#include "engine/render/renderer.h"
#include "tests/support/compare.h"
#include "tests/support/random_scene.h"
#include "tests/support/shared_device.h"

namespace darb::test {

struct DeviceWalk {
    gpu::FrameStatus status;
    ImageF image;                                       // [H][W][3]
    std::array<std::vector<float>, kAttributeCount> d;  // dL/d(attribute), layout of SplatModel
    std::vector<float> mean_gradient_ndc;               // [N] |dL/dmean|
};

struct WalkSettings {
    int evaluation = EVALUATION_POLYNOMIAL;
    float alpha_cutoff = static_cast<float>(ALPHA_CUTOFF_DEFAULT);
    float transmittance_stop = static_cast<float>(TRANSMITTANCE_STOP);
    glm::vec3 background{0.0f};
    int sh_degree = 3;              // in use, at most the model's
    std::uint32_t pairs = 100'000;  // capacity
};

inline ForwardOptions forward_options(const SplatModel& model, const WalkSettings& settings) {
    ForwardOptions options;
    options.kernel = model.kernel;
    options.footprint = model.footprint;
    options.evaluation = settings.evaluation;
    options.alpha_cutoff = settings.alpha_cutoff;
    options.transmittance_stop = settings.transmittance_stop;
    options.sh_stored = model.sh_degree;
    options.store_for_backward = true;
    return options;
}

/// Interleaved [H][W][3] to planes [3][H][W].
inline std::vector<float> to_planes(const Image<double>& image) {
    const size_t pixels = image.data.size() / 3;
    std::vector<float> planes(pixels * 3);
    for (size_t i = 0; i < pixels; ++i)
        for (size_t c = 0; c < 3; ++c)
            planes[c * pixels + i] = static_cast<float>(image.data[i * 3 + c]);
    return planes;
}

/// Forward alone, its passes still at hand, and backward where d_image is not empty.
inline DeviceWalk walk_on_device(const SplatModel& model, const Camera& camera,
                                 const Image<double>& d_image, const WalkSettings& settings) {
    Device& device = shared_device();
    const ForwardOptions options = forward_options(model, settings);
    const int degree = std::min(settings.sh_degree, model.sh_degree);
    GpuSplats splats(device, model, true);
    Forward forward(device, options);
    Backward backward(device, options, BackwardResult::store_gradient);
    const gpu::CameraData data = camera_data(camera, model.origin);
    const Buffer cameras = upload_cameras(device, {data});
    const size_t floats = size_t(camera.width) * camera.height * 3;
    Buffer d_planes(device, "d_image", floats * sizeof(float));
    if (!d_image.data.empty()) d_planes.upload(to_planes(d_image));
    forward.reserve(splats.count(), settings.pairs, camera.width, camera.height);
    backward.reserve(splats.count(), forward.pair_capacity());

    Commands commands(device);
    commands.begin();
    forward.record(commands, splats, cameras, 0, data, degree, settings.background);
    if (!d_image.data.empty())
        backward.record(commands, forward, splats, d_planes, cameras, 0, data, degree,
                        settings.background, AdamStep{});
    commands.submit_and_wait();

    DeviceWalk walk;
    walk.status = forward.read_status();
    walk.image =
        planes_to_image(forward.image().download<float>(floats), camera.width, camera.height);
    if (d_image.data.empty()) return walk;
    for (int a = 0; a < kAttributeCount; ++a) {
        const size_t n = size_t{splats.count()} * splats.stride(a);
        const auto moments = splats.moments(a).download<float>(n * 2);
        for (size_t i = 0; i < n; ++i) walk.d[a].push_back(moments[2 * i]);
    }
    const auto sums = backward.gradient_sum().download<float>(size_t{splats.count()} * 2);
    for (size_t i = 0; i < splats.count(); ++i) walk.mean_gradient_ndc.push_back(sums[2 * i]);
    return walk;
}

}  // namespace darb::test
