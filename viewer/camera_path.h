// SPDX-License-Identifier: MIT
// CameraPath: key frames that a camera flies through smoothly. The position and the logarithm of
// tan(fov / 2) follow cubic Hermite curves through the keys, with tangents from finite differences
// over time (Catmull-Rom where the times are even). The orientation follows the same curve on
// quaternions of one hemisphere, which are then normalised.
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
    std::filesystem::path file;  // the file that the path was read from, for messages; may be empty
    // Set by a path of nerfstudio, which names them; otherwise 0.
    int width = 0, height = 0;  // px
    double fps = 0;             // frames a second
    std::vector<std::string> notes;

    double duration() const { return keys.empty() ? 0 : keys.back().seconds; }
    /// Adds the current view as a key, `seconds` after the last one (the first key is at 0).
    void add(const Navigation& view, double seconds = 2);
    /// Times outside the path give its first or its last key. The path must not be empty.
    KeyFrame sample(double seconds) const;
};

/// Moves the camera to the key; its up and pivot distance stay.
void apply(const KeyFrame& key, Navigation& view);

/// The file is JSON: {"key_frames": [{"seconds", "eye": [3], "orientation": [w, x, y, z],
/// "fov_y_degrees"}]}. read also takes a camera_path.json of nerfstudio, with a key for each of its
/// frames. It throws an Error that names the file and the key; a path lasts at most a day.
void write_camera_path(const std::filesystem::path& file, const CameraPath& path);
CameraPath read_camera_path(const std::filesystem::path& file);

// A camera that goes once around a scene, which is the film of a scene without a camera path.

struct TurntableOptions {
    double seconds = 6;  // how long the turn takes
    int fps = 30;
    int width = 1280, height = 720;  // size of the frames, px
    glm::dvec3 up{0, -1, 0};         // unit, world
    std::vector<Camera> cameras;     // the photos' cameras; may be none
};

/// Makes a key for each frame; the one after the last would be the first again. The camera circles
/// the subject_of the cameras at their median height. It is as near as the subject is seen whole
/// all the way, but at most a quarter farther than the cameras are, because there is nothing behind
/// them that they saw. Where they leave out a third of a turn or more, the camera goes to and fro
/// where they were. Where they look outwards, it stands among them and turns its head. Without
/// cameras it looks down from 15 degrees above.
CameraPath turntable(const SplatModel& model, const TurntableOptions& options);

}  // namespace darb
