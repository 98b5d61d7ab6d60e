#include "tools/cost/picture_error.h"

#include <algorithm>
#include <cmath>

#include "engine/core/check.h"
#include "engine/plan/accuracy.h"
#include "engine/reference/reference_render.h"

namespace darb {

namespace {

constexpr double kPercentile = 0.999;
constexpr double kLeastMse = 1e-20;  // 200 dB

}  // namespace

PictureError picture_error(const std::vector<ImageF>& pictures, const std::vector<ImageF>& truth) {
    DARB_CHECK(pictures.size() == truth.size(), "{} and {}", pictures.size(), truth.size());
    std::vector<float> errors;
    double sum = 0;
    for (size_t v = 0; v < truth.size(); ++v) {
        DARB_CHECK(pictures[v].data.size() == truth[v].data.size(), "view {}", v);
        for (size_t i = 0; i < truth[v].data.size(); ++i) {
            const double e = std::abs(double(std::clamp(pictures[v].data[i], 0.0f, 1.0f)) -
                                      double(std::clamp(truth[v].data[i], 0.0f, 1.0f)));
            sum += e * e;
            errors.push_back(static_cast<float>(e));
        }
    }
    PictureError result;
    if (errors.empty()) return result;
    result.mse = sum / static_cast<double>(errors.size());
    result.psnr_db = -10 * std::log10(std::max(result.mse, kLeastMse));
    result.largest = *std::max_element(errors.begin(), errors.end());
    const auto at = errors.begin() + static_cast<std::ptrdiff_t>(
                                         kPercentile * static_cast<double>(errors.size() - 1));
    std::nth_element(errors.begin(), at, errors.end());
    result.percentile = *at;
    return result;
}

std::vector<ImageF> true_pictures(const SplatModel& model, const std::vector<Camera>& cameras,
                                  const glm::vec3& background, bool by_pixel) {
    const Accuracy exact = preset_accuracy(kExact);
    reference::RenderSettings settings;
    settings.alpha_cutoff = exact.value(kAlphaCutoff);
    settings.transmittance_stop = exact.value(kTransmittanceStop);
    if (by_pixel) settings.depth_order = DEPTH_ORDER_PIXEL;
    for (int c = 0; c < 3; ++c) settings.background[c] = background[c];
    const auto splats = reference::make_splats<double>(model);
    std::vector<ImageF> pictures;
    for (Camera camera : cameras) {
        camera.translation += camera.rotation * model.origin;  // positions are relative to it
        const auto result = reference::render(splats, camera, settings);
        ImageF picture(camera.width, camera.height, 3);
        std::copy(result.images.colour.data.begin(), result.images.colour.data.end(),
                  picture.data.begin());
        pictures.push_back(std::move(picture));
    }
    return pictures;
}

}  // namespace darb
