// A camera that goes once around a scene, as a film of it begins where there are no cameras.
#pragma once

#include <vector>

#include "engine/scene/camera.h"
#include "engine/scene/splat_model.h"
#include "viewer/camera_path.h"

namespace darb {

struct TurntableOptions {
    double seconds = 6;  // of the turn
    int fps = 30;
    int width = 1280, height = 720;  // px, of the frames
    glm::dvec3 up{0, -1, 0};         // unit, world
    std::vector<Camera> cameras;     // of the photos; may be none
};

/// A key for each frame; the one after the last would be the first. Around the subject_of the
/// cameras, as high above it as they stand in the middle, and as near as it is seen whole all the
/// way, but no farther than they are by more than a quarter: behind them there is nothing that they
/// saw. Where they leave a third of a turn or more out, the camera goes to and fro where they were.
/// Where they look outwards it stands among them and turns its head. Without cameras: from 15
/// degrees above.
CameraPath turntable(const SplatModel& model, const TurntableOptions& options);

}  // namespace darb
