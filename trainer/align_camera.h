// The pose under which the picture of a scene comes nearest to a photo, the scene as it is: what
// makes held-out photos comparable between runs whose cameras moved, or whose poses are not exact.
#pragma once

#include "engine/core/image.h"
#include "engine/render/render_gradients.h"
#include "engine/scene/pose_metric.h"

namespace darb {

class CameraAlignment {
  public:
    /// Of this model's pictures.
    CameraAlignment(Device& device, const SplatModel& model, const Accuracy& accuracy = {});

    /// The camera, turned and moved; intrinsics stay. 40 steps of Adam on the mean squared error,
    /// of 0.2 px at first and 0.01 px in the end; that with the least error on the way counts.
    /// photo: RGBA of the camera's size. Masked pixels do not count where alpha is a mask.
    Camera align(const Camera& camera, const ImageU8& photo, const glm::vec3& background,
                 bool alpha_is_mask);

  private:
    GradientRenderer renderer_;
    std::vector<glm::dvec3> places_;  // of splats
    double depth_ = 1;
};

}  // namespace darb
