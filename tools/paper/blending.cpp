#include "tools/paper/blending.h"

#include "engine/core/check.h"
#include "engine/core/quantile.h"
#include "engine/reference/reference_render.h"
#include "engine/render/renderer.h"

namespace darb {

namespace {

double blended_splats(const SplatModel& model, const Camera& camera) {
    const reference::RenderResult result =
        reference::render(model, camera, reference::RenderSettings{});
    double sum = 0;
    for (const std::int32_t n : result.images.contributions.data) sum += n;
    return sum;
}

}  // namespace

BlendStatistics measure_blending(Device& device, const SplatModel& model,
                                 const std::vector<Camera>& cameras, int repeats) {
    DARB_CHECK(!cameras.empty() && repeats >= 1, "{} cameras, {} repeats", cameras.size(), repeats);
    ProjectionEffects effects;
    for (const Camera& camera : cameras) effects.lens |= camera.lens.active;
    Renderer renderer(device, model, {}, effects);
    BlendStatistics sum;
    double splats = 0, pixels = 0, intersections = 0, visible = 0;
    for (const Camera& camera : cameras) {
        renderer.render(camera);  // warm-up, and buffers of their size
        intersections += renderer.status().intersections;
        visible += renderer.status().visible;
        splats += blended_splats(model, camera);
        pixels += double(camera.width) * camera.height;
        std::vector<double> blend, frame;
        for (int r = 0; r < repeats; ++r) {
            renderer.render(camera);
            double of_blend = 0, of_frame = 0;
            for (const PassTime& pass : renderer.pass_times()) {
                of_frame += pass.ms;
                if (pass.name == "blend") of_blend += pass.ms;
            }
            blend.push_back(of_blend);
            frame.push_back(of_frame);
        }
        sum.blend_ms += median(blend);
        sum.frame_ms += median(frame);
    }
    const double count = static_cast<double>(cameras.size());
    sum.blended_per_pixel = splats / pixels;
    sum.intersections_per_splat = visible > 0 ? intersections / visible : 0;
    sum.ns_per_splat_pixel = splats > 0 ? 1e6 * sum.blend_ms / splats : 0;
    sum.blend_ms /= count;
    sum.frame_ms /= count;
    return sum;
}

}  // namespace darb
