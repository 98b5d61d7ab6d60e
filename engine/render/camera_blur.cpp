// SPDX-License-Identifier: MIT
#include "engine/render/camera_blur.h"

#include <array>
#include <cmath>
#include <cstdint>

#include "engine/core/error.h"

namespace darb {

namespace {

constexpr double kGoldenAngle = 2.399963229728653;  // spreads samples evenly over a disc

double light_of(double stored) {
    return stored <= 0.04045 ? stored / 12.92 : std::pow((stored + 0.055) / 1.055, 2.4);
}

double stored_of(double light) {
    return light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
}

}  // namespace

Camera through_lens(const Camera& camera, const CameraBlur& blur, int i) {
    if (!(blur.aperture > 0)) return camera;
    const double radius = blur.aperture * std::sqrt((i + 0.5) / blur.samples);
    const glm::dvec2 moved =
        radius * glm::dvec2(std::cos(kGoldenAngle * i), std::sin(kGoldenAngle * i));
    Camera sample = camera;
    sample.translation -= glm::dvec3(moved, 0);
    sample.cx += camera.fx * moved.x / blur.focus;
    sample.cy += camera.fy * moved.y / blur.focus;
    return sample;
}

double shutter_time(const CameraBlur& blur, int i) {
    return blur.shutter * ((i + 0.5) / blur.samples - 0.5);
}

void MeanPicture::add(const ImageU8& picture) {
    static const std::array<float, 256> light = [] {
        std::array<float, 256> table;
        for (std::size_t v = 0; v < table.size(); ++v)
            table[v] = static_cast<float>(light_of(static_cast<double>(v) / 255));
        return table;
    }();
    if (count_ == 0) {
        width_ = picture.width;
        height_ = picture.height;
        channels_ = picture.channels;
        light_.assign(picture.data.size(), 0.0f);
    } else if (picture.width != width_ || picture.height != height_ ||
               picture.channels != channels_) {
        throw Error("mean of pictures", "they differ in size", "Render all at one size.");
    }
    for (std::size_t p = 0; p < light_.size(); ++p) light_[p] += light[picture.data[p]];
    ++count_;
}

ImageU8 MeanPicture::mean() const {
    ImageU8 picture(width_, height_, channels_);
    for (std::size_t p = 0; p < light_.size(); ++p)
        picture.data[p] = static_cast<std::uint8_t>(
            std::lround(255 * stored_of(light_[p] / static_cast<double>(count_))));
    return picture;
}

}  // namespace darb
