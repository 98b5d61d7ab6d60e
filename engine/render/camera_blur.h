// SPDX-License-Identifier: MIT
// What a real camera blurs, by averaging pictures of sharp cameras: what lies out of focus, and
// what moves while the shutter is open.
#pragma once

#include <cstddef>
#include <vector>

#include "engine/core/image.h"
#include "engine/scene/camera.h"

namespace darb {

struct CameraBlur {
    double aperture = 0;  // its radius, world units; 0: everything is sharp
    double focus = 0;     // distance along the optical axis that is sharp, world units
    double shutter = 0;   // seconds that the shutter is open; 0: nothing moves
    int samples = 32;     // pictures that are averaged
    bool on() const { return aperture > 0 || shutter > 0; }
};

/// The camera as sample `i` of the lens sees it: moved within the lens's disc, and sheared so that
/// everything at the distance of the focus stays where it is. The samples cover the disc evenly.
Camera through_lens(const Camera& camera, const CameraBlur& blur, int i);

/// When sample `i` is taken (0 where the shutter does not matter), in seconds from the middle of
/// the time that the shutter is open.
double shutter_time(const CameraBlur& blur, int i);

/// The mean of pictures as a sensor takes it: in linear light, not of the stored values, which are
/// encoded by sRGB.
class MeanPicture {
  public:
    /// All pictures have the same shape. Throws Error where one differs.
    void add(const ImageU8& picture);
    /// At least one picture was added.
    ImageU8 mean() const;

  private:
    int width_ = 0, height_ = 0, channels_ = 0;
    std::size_t count_ = 0;
    std::vector<float> light_;
};

/// The mean of what draw(i) gives for each sample i; a blur that is off has one sample, 0.
template <class Draw>
ImageU8 blurred(const CameraBlur& blur, const Draw& draw) {
    if (!blur.on()) return draw(0);
    MeanPicture picture;
    for (int i = 0; i < blur.samples; ++i) picture.add(draw(i));
    return picture.mean();
}

}  // namespace darb
