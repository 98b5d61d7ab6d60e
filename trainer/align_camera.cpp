#include "trainer/align_camera.h"

#include <cmath>

#include "engine/core/quantile.h"
#include "engine/data/compare_view.h"

namespace darb {

namespace {

constexpr int kSteps = 40;
constexpr double kFirstRate_px = 0.2, kLastRate_px = 0.01;
constexpr double kAlignBeta1 = 0.8, kAlignBeta2 = 0.95;
constexpr std::size_t kMostPlaces = 5'000;

GradientOptions gradient_options(const Accuracy& accuracy) {
    GradientOptions options;
    options.accuracy = accuracy;
    options.camera = true;
    return options;
}

// The mean squared error of the picture and its gradient.
double squared_error(const ImageF& image, const ImageF& truth, const ImageU8& photo, bool masked,
                     ImageF& d_image) {
    double sum = 0, count = 0;
    const std::size_t pixels = std::size_t(photo.width) * photo.height;
    for (std::size_t p = 0; p < pixels; ++p) {
        const bool counts = !masked || photo.data[4 * p + 3] >= 128;
        count += counts ? 3 : 0;
        for (std::size_t c = 3 * p; c < 3 * p + 3; ++c) {
            const float error = counts ? image.data[c] - truth.data[c] : 0.0f;
            d_image.data[c] = 2 * error;
            sum += double(error) * error;
        }
    }
    for (float& d : d_image.data) d /= static_cast<float>(std::max(count, 1.0));
    return sum / std::max(count, 1.0);
}

// d/d(step) where the step is none: turns act on the left.
PoseVector by_step(const Camera& camera, const CameraGradient& d) {
    glm::dvec3 turn = glm::cross(camera.translation, d.d_translation);
    for (int c = 0; c < 3; ++c) turn += glm::cross(camera.rotation[c], d.d_rotation[c]);
    return {turn.x, turn.y, turn.z, d.d_translation.x, d.d_translation.y, d.d_translation.z};
}

}  // namespace

CameraAlignment::CameraAlignment(Device& device, const SplatModel& model, const Accuracy& accuracy)
    : renderer_(device, model, gradient_options(accuracy)) {
    const std::size_t step = model.size() / kMostPlaces + 1;
    for (std::size_t i = 0; i < model.size(); i += step)
        places_.push_back(glm::dvec3(model.position[3 * i], model.position[3 * i + 1],
                                     model.position[3 * i + 2]) +
                          model.origin);
}

Camera CameraAlignment::align(const Camera& camera, const ImageU8& photo,
                              const glm::vec3& background, bool alpha_is_mask) {
    const PoseMetric metric(camera, places_, depth_);
    const ImageF truth = composite(photo, background);
    ImageF d_image(photo.width, photo.height, 3);
    Camera now = camera, best = camera;
    PoseVector first{}, second{};
    double least = 0;
    for (int step = 0; step <= kSteps; ++step) {
        const double error =
            squared_error(renderer_.render(now, background), truth, photo, alpha_is_mask, d_image);
        if (step == 0 || error < least) {
            least = error;
            best = now;
        }
        if (step == kSteps) break;
        const ViewGradients view = renderer_.backward(d_image);
        const PoseVector d = metric.gradient(by_step(now, *view.d_camera));
        const double rate =
            kFirstRate_px * std::pow(kLastRate_px / kFirstRate_px, double(step) / kSteps);
        PoseVector x{};
        for (std::size_t i = 0; i < 6; ++i) {
            first[i] = kAlignBeta1 * first[i] + (1 - kAlignBeta1) * d[i];
            second[i] = kAlignBeta2 * second[i] + (1 - kAlignBeta2) * d[i] * d[i];
            const double size = std::sqrt(second[i] / (1 - std::pow(kAlignBeta2, step + 1)));
            if (size > 0) x[i] = -rate * first[i] / (1 - std::pow(kAlignBeta1, step + 1)) / size;
        }
        now = moved_camera(now, metric.to_step(x));
    }
    return best;
}

}  // namespace darb
