// SPDX-License-Identifier: MIT
// cameras.json, as 3DGS writes it beside a scene, and cameras from any file or folder a user names.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/data/dataset.h"

namespace darb {

/// Parses a list of {id, img_name, width, height, position, rotation, fx, fy} and, where the
/// principal point is off the centre, cx and cy; where the shutter rolls, shutter {turn, move}, as
/// in engine/scene/camera.h. rotation has the rows of camera to world. The views have no photo.
/// Throws Error naming the record.
std::vector<View> parse_camera_list(std::string_view json, const std::string& where);
/// A camera_path.json as nerfstudio's viewer exports it: one camera per frame, named frame_00000
/// and so on.
struct NerfstudioPath {
    std::vector<View> views;
    double fps = 24;                 // frames a second
    std::vector<std::string> notes;  // features of the path that are ignored, one sentence each
};
/// Returns nothing where the text is other JSON, or not JSON. Throws Error naming the frame.
std::optional<NerfstudioPath> parse_nerfstudio_path(std::string_view json,
                                                    const std::string& where);
std::string format_camera_list(const std::vector<View>& views);

/// Writes the list with write_file_atomic.
void write_camera_list(const std::filesystem::path& path, const std::vector<View>& views);

std::vector<Camera> cameras_of(const std::vector<View>& views);

/// Loads cameras from a data set folder, a folder with cameras.json, a transforms.json or a
/// cameras.json. Photos need not exist. notes: receives the notes of the data set.
std::vector<View> load_cameras(const std::filesystem::path& path,
                               const DatasetOptions& options = {},
                               std::vector<std::string>* notes = nullptr);

// Poses as files state them, checked on the way in.

/// Converts w x y z, of any norm above 1e-6, to a rotation matrix. Throws Error(where, ...) where
/// the quaternion is zero or not finite.
glm::dmat3 rotation_from_quaternion(glm::dvec4 wxyz, const std::string& where);

/// Divides the columns by their mean length where that differs from 1 by more than 1e-3, and
/// returns whether it did. checked_rotation refuses a matrix that is then still no rotation.
bool remove_scale(glm::dmat3& matrix);

/// The rotation nearest to `matrix`. Throws Error where an entry is not finite, or the matrix
/// mirrors or is not orthonormal to 1e-3.
glm::dmat3 checked_rotation(const glm::dmat3& matrix, const std::string& where);

/// w x y z of a rotation matrix, with unit norm and w >= 0.
glm::dvec4 quaternion_from_rotation(const glm::dmat3& rotation);

/// Throws Error where the vector is not finite.
void check_position(glm::dvec3 position, const std::string& where);

}  // namespace darb
