// The whole walk of a random scene, image and every gradient, against the reference.
#include "engine/check/run_checks.h"
#include "engine/check/walk_truth.h"
#include "engine/kernels/kernel_profile.h"
#include "engine/reference/random_scene.h"

namespace darb::check {

namespace {

// Dense; but sparse where the kernel jumps at its edge, for there every pixel that rounding moves
// across the edge changes by a tenth of the opacity.
reference::TestScene walk_scene(int kernel, Footprint footprint) {
    if (footprint == Footprint::psi && kernel_profile(kernel).edge_order == 0)
        return reference::random_scene(
            {.count = 60, .width = 53, .height = 37, .kernel = kernel, .seed = 7});
    return reference::random_scene({.count = 300,
                                    .width = 121,
                                    .height = 83,
                                    .kernel = kernel,
                                    .footprint = footprint,
                                    .min_log_scale = -4,
                                    .max_log_scale = -1,
                                    .min_logit = -4,
                                    .max_logit = 5,
                                    .seed = 21});
}

}  // namespace

std::vector<Row> check_walk(Device& device, int kernel, Footprint footprint, int evaluation,
                            bool float_alone) {
    const reference::TestScene scene = walk_scene(kernel, footprint);
    WalkSettings settings;
    settings.evaluation = evaluation;
    settings.background = {0.2f, 0.4f, 0.7f};
    const Image<double> weights = random_weights(scene.camera);
    const DeviceWalk walk = walk_on_device(device, scene.model, scene.camera, weights, settings);
    const WalkTruth truth = walk_in_double(scene.model, scene.camera, weights, settings);
    const std::string group =
        fmt::format("walk, {} {}{}", kernel_name(kernel), footprint_name(footprint),
                    evaluation == EVALUATION_BUILTIN ? ", built-in" : "");
    const bool steep = footprint == Footprint::exact && ends_with_a_jump(kernel);
    const char* allowed = steep ? "gradient_steep_float32" : "gradient_scaled_float32";
    // Image, every gradient and the mean gradient of the device or of the reference in float.
    const auto compared = [&](const auto& image, const auto& got) {
        std::vector<Row> rows{compare_row(group, "image", truth.image, image, "image_float32")};
        for (int a = 0; a < kAttributeCount; ++a)
            if (!truth.d[static_cast<size_t>(a)].empty())
                rows.push_back(compare_row(group, std::string("d_") + attribute_name(a), truth.d[a],
                                           got.d[a], allowed, true));
        rows.push_back(compare_row(group, "mean gradient", truth.mean_gradient_ndc,
                                   got.mean_gradient_ndc, allowed, true));
        return rows;
    };
    std::vector<Row> rows = compared(walk.image.data, walk);
    if (float_alone) {
        const WalkTruth in_float = walk_in_float(scene.model, scene.camera, weights, settings);
        const std::vector<Row> alone = compared(in_float.image, in_float);
        for (size_t r = 0; r < rows.size(); ++r) rows[r].float_alone = alone[r].error;
    }
    const bool whole = walk.status.visible > scene.model.size() / 2 &&
                       walk.status.bad_gradients == 0 && walk.status.visible >= truth.visible &&
                       walk.status.visible <= truth.visible + 3;
    rows.push_back(
        fact_row(group, "visible splats", whole,
                 fmt::format("{} on the device with {} bad gradients, {} in double",
                             walk.status.visible, walk.status.bad_gradients, truth.visible)));
    return rows;
}

}  // namespace darb::check
