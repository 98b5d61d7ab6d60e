#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/core/error.h"
#include "engine/data/lens_model.h"
#include "engine/data/resample.h"

namespace darb {

namespace {

constexpr double kMaxTangent = 1.7320508075688772;  // 60 degrees to each side
constexpr int kBorderSamples = 128;                 // a side
constexpr double kMaxGrowth = 2.0;                  // of the size, against extreme magnification

/// Bounds of the frame on the plane z = 1.
struct Bounds {
    double left = -kMaxTangent, right = kMaxTangent, top = -kMaxTangent, bottom = kMaxTangent;
};

/// The largest rectangle whose sides lie inside the four undistorted borders. Border points without
/// an inverse (beyond 90 degrees or the fold) leave the cap in place.
Bounds inner_bounds(const Lens& lens, const LensModel& model) {
    Bounds bounds;
    const double right = model.width - 0.5, bottom = model.height - 0.5;
    for (int i = 0; i <= kBorderSamples; ++i) {
        const double along = static_cast<double>(i) / kBorderSamples;
        const double x = 0.5 + along * (right - 0.5), y = 0.5 + along * (bottom - 0.5);
        if (const auto ray = lens.unproject({0.5, y})) bounds.left = std::max(bounds.left, ray->x);
        if (const auto ray = lens.unproject({right, y}))
            bounds.right = std::min(bounds.right, ray->x);
        if (const auto ray = lens.unproject({x, 0.5})) bounds.top = std::max(bounds.top, ray->y);
        if (const auto ray = lens.unproject({x, bottom}))
            bounds.bottom = std::min(bounds.bottom, ray->y);
    }
    return bounds;
}

glm::dvec2 ray_of(const Camera& camera, double x, double y) {
    return {(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy};
}

/// Half a pixel of tolerance: the outermost photo pixels repeat outwards.
bool inside(const LensModel& model, glm::dvec2 pixel) {
    return pixel.x >= 0 && pixel.y >= 0 && pixel.x <= model.width && pixel.y <= model.height;
}

bool has_gaps(const Lens& lens, const LensModel& model, const Camera& camera) {
    const auto gap = [&](double x, double y) {
        const glm::dvec2 ray = ray_of(camera, x, y);
        return !lens.valid(ray) || !inside(model, lens.project(ray));
    };
    const double right = camera.width - 0.5, bottom = camera.height - 0.5;
    for (int i = 0; i <= kBorderSamples; ++i) {
        const double along = static_cast<double>(i) / kBorderSamples;
        const double x = 0.5 + along * (right - 0.5), y = 0.5 + along * (bottom - 0.5);
        if (gap(0.5, y) || gap(right, y) || gap(x, 0.5) || gap(x, bottom)) return true;
    }
    return false;
}

struct Sample {
    float rgb[3] = {0, 0, 0};  // times alpha
    float alpha = 0;           // 0 to 255
};

/// Bilinear; the outermost pixels repeat outwards.
Sample sample(const ImageU8& rgba, glm::dvec2 pixel) {
    const double x = std::clamp(pixel.x - 0.5, 0.0, rgba.width - 1.0);
    const double y = std::clamp(pixel.y - 0.5, 0.0, rgba.height - 1.0);
    const auto x0 = static_cast<std::size_t>(x), y0 = static_cast<std::size_t>(y);
    const std::size_t x1 = std::min(x0 + 1, static_cast<std::size_t>(rgba.width) - 1);
    const std::size_t y1 = std::min(y0 + 1, static_cast<std::size_t>(rgba.height) - 1);
    const auto u = static_cast<float>(x - static_cast<double>(x0));
    const auto v = static_cast<float>(y - static_cast<double>(y0));
    const auto stride = static_cast<std::size_t>(rgba.width);
    const std::size_t corners[4] = {y0 * stride + x0, y0 * stride + x1, y1 * stride + x0,
                                    y1 * stride + x1};
    const float weights[4] = {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v};
    Sample sum;
    for (int i = 0; i < 4; ++i) {
        const std::uint8_t* from = &rgba.data[corners[i] * 4];
        const float alpha = weights[i] * static_cast<float>(from[3]);
        for (int c = 0; c < 3; ++c) sum.rgb[c] += alpha * static_cast<float>(from[c]);
        sum.alpha += alpha;
    }
    return sum;
}

}  // namespace

bool too_wide_to_undistort(const LensModel& model) {
    if (!model.distorted() || !(model.model.ends_with("FISHEYE") || model.model == "FOV"))
        return false;
    const Lens lens(model);
    const glm::dvec2 middle = glm::clamp(lens.principal, glm::dvec2(0.5),
                                         glm::dvec2(model.width - 0.5, model.height - 0.5));
    for (const glm::dvec2 border :
         {glm::dvec2(0.5, middle.y), glm::dvec2(model.width - 0.5, middle.y),
          glm::dvec2(middle.x, 0.5), glm::dvec2(middle.x, model.height - 0.5)}) {
        const auto ray = lens.unproject(border);
        if (!ray || std::max(std::abs(ray->x), std::abs(ray->y)) > kMaxTangent) return true;
    }
    return false;
}

UndistortedFrame undistorted_frame(const LensModel& model, const std::string& where) {
    UndistortedFrame frame;
    Camera& camera = frame.camera;
    camera = pinhole_camera(model);
    if (!model.distorted()) return frame;

    const Lens lens(model);
    const Bounds bounds = inner_bounds(lens, model);
    const double width = bounds.right - bounds.left, height = bounds.bottom - bounds.top;
    if (!(width > 0) || !(height > 0))
        throw Error(where, "the lens distortion leaves no rectangle of the photo",
                    "Check the distortion coefficients, or undistort with colmap.");
    const double shrink = std::min({1.0, kMaxGrowth * model.width / (width * camera.fx),
                                    kMaxGrowth * model.height / (height * camera.fy)});
    camera.fx *= shrink;
    camera.fy *= shrink;
    // The centres of the outermost pixels lie on the bounds.
    camera.width = std::max(1, static_cast<int>(width * camera.fx + 1 + 1e-6));
    camera.height = std::max(1, static_cast<int>(height * camera.fy + 1 + 1e-6));
    camera.cx = 0.5 - bounds.left * camera.fx;
    camera.cy = 0.5 - bounds.top * camera.fy;
    frame.has_gaps = has_gaps(lens, model, camera);
    return frame;
}

ImageU8 undistort(const ImageU8& rgba, const LensModel& model, const Camera& camera) {
    if (rgba.channels != 4 || rgba.width != model.width || rgba.height != model.height)
        throw Error("undistort",
                    fmt::format("a photo of {}x{}x{} and a lens for {}x{}", rgba.width, rgba.height,
                                rgba.channels, model.width, model.height),
                    "Use RGBA, and scale_lens for the size of the photo.");
    const Lens lens(model);
    ImageU8 out(camera.width, camera.height, 4);
    std::uint8_t* to = out.data.data();
    for (int y = 0; y < camera.height; ++y)
        for (int x = 0; x < camera.width; ++x, to += 4) {
            const glm::dvec2 ray = ray_of(camera, x + 0.5, y + 0.5);
            if (!lens.valid(ray)) continue;
            const glm::dvec2 pixel = lens.project(ray);
            if (!inside(model, pixel)) continue;
            const Sample at = sample(rgba, pixel);
            if (!(at.alpha > 0)) continue;
            for (int c = 0; c < 3; ++c)
                to[c] = static_cast<std::uint8_t>(std::min(at.rgb[c] / at.alpha + 0.5f, 255.0f));
            to[3] = static_cast<std::uint8_t>(std::min(at.alpha + 0.5f, 255.0f));
        }
    return out;
}

}  // namespace darb
