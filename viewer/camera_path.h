// SPDX-License-Identifier: MIT
// CameraPath: key frames that a camera flies through smoothly. Position and the logarithm of
// tan(fov / 2) are cubic Hermite curves through the keys, tangents by finite differences over time
// (Catmull-Rom where the times are even); orientation is the same curve on quaternions of one
// hemisphere, normalised.
#pragma once

#include <filesystem>
#include <glm/gtc/quaternion.hpp>
#include <string>
#include <vector>

#include "engine/scene/camera.h"
#include "engine/scene/splat_model.h"
#include "viewer/navigation.h"

namespace darb {

struct KeyFrame {
    double seconds = 0;  // from the start; ascending along a path
    glm::dvec3 eye{0.0};
    glm::dquat orientation{1, 0, 0, 0};  // camera to world
    double fov_y = 0;                    // rad
    bool operator==(const KeyFrame&) const = default;
};

struct CameraPath {
    std::vector<KeyFrame> keys;
    std::filesystem::path file;  // that it was read from, for messages; may be empty
    // Of a path of nerfstudio, which says them; else 0.
    int width = 0, height = 0;  // px
    double fps = 0;             // frames a second
    std::vector<std::string> notes;

    double duration() const { return keys.empty() ? 0 : keys.back().seconds; }
    /// The current view, `seconds` after the last key (the first is at 0).
    void add(const Navigation& view, double seconds = 2);
    /// Before the first and after the last key: that key. The path must not be empty.
    KeyFrame sample(double seconds) const;
};

/// Puts the camera there; up and pivot distance stay.
void apply(const KeyFrame& key, Navigation& view);

/// JSON: {"key_frames": [{"seconds", "eye": [3], "orientation": [w, x, y, z], "fov_y_degrees"}]}.
/// read takes a camera_path.json of nerfstudio, too, with a key for each of its frames. It throws
/// Error naming file and key; a path lasts at most a day.
void write_camera_path(const std::filesystem::path& file, const CameraPath& path);
CameraPath read_camera_path(const std::filesystem::path& file);

// A camera that goes once around a scene, as a film of it begins where there are no cameras.

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
