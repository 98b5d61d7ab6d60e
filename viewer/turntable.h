// A camera that goes once around a scene, as a film of it begins where there are no cameras.
#pragma once

#include "engine/scene/splat_model.h"
#include "viewer/camera_path.h"

namespace darb {

struct TurntableOptions {
    double seconds = 6;  // of the turn
    int fps = 30;
    int width = 1280, height = 720;  // px, of the frames
    glm::dvec3 up{0, -1, 0};         // unit, world
};

/// A key for each frame; the one after the last would be the first. From 15 degrees above, as near
/// as the whole scene is seen all the way round.
CameraPath turntable(const SplatModel& model, const TurntableOptions& options);

}  // namespace darb
