// SPDX-License-Identifier: MIT
// transforms.json as the file states it: NeRF synthetic, instant-ngp and nerfstudio. Accesses no
// files. Keys that would change the meaning but are not supported become notes.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/data/dataset.h"

namespace darb {

/// What a frame declares, or the file for all frames.
struct TransformsIntrinsics {
    std::optional<double> w, h, fl_x, fl_y, cx, cy;        // px
    std::optional<double> camera_angle_x, camera_angle_y;  // rad
    std::array<double, 6> k{};                             // k1 to k6
    double p1 = 0, p2 = 0;
    std::string camera_model;        // nerfstudio's name; empty where not stated
    std::optional<bool> is_fisheye;  // instant-ngp
    double crop_radius = 0;          // nerfstudio: px around the middle that count; 0: all
};

struct TransformsFrame {
    std::string file_path;   // as written
    std::string mask_path;   // may be empty
    std::string depth_path;  // depth_file_path or instant-ngp's depth_path, may be empty
    TransformsIntrinsics intrinsics;
    glm::dmat3 rotation{1.0};  // world to camera, COLMAP's axes; with a shutter, of the middle row
    glm::dvec3 translation{0.0};
    ShutterTerms shutter;
};

struct TransformsFile {
    std::vector<TransformsFrame> frames;
    std::string ply_file_path;  // may be empty
    // Metres a step: depth_unit_scale_factor (nerfstudio), which applies to all depths, or
    // integer_depth_scale (instant-ngp), which applies to integers only; 0: not declared.
    double depth_unit = 0;
    bool unit_of_integers = false;
    bool read_depths = true;   // nerfstudio's enable_depth_loading
    double applied_scale = 1;  // world units a metre: how the writer of the file scaled the poses
    // nerfstudio's split, which may be empty; val_filenames where test_filenames is empty.
    std::vector<std::string> train_filenames, test_filenames;
    std::size_t scaled_poses = 0;    // poses whose rotation contained a scale
    std::vector<std::string> notes;  // one sentence each
};

/// transform_matrix is camera to world with OpenGL's camera axes (y up, looking down -z). The
/// writer has already applied nerfstudio's applied_transform to the frames and the PLY alike, so
/// both stay in the file's frame; so do instant-ngp's scale and offset, which it applies when it
/// reads. A rolling shutter is read in two forms: rolling_shutter_time, seconds, with
/// camera_linear_velocity and camera_angular_velocity of each frame, in units a second along the
/// axes of transform_matrix, the pose of the middle row; and instant-ngp's rolling_shutter
/// [t, by column, by row, blur] with transform_matrix_start and _end. Numbers may be given as
/// strings, and rotations may contain a scale. Throws Error(where and frame, reason), also where
/// two keys for one fact disagree.
TransformsFile parse_transforms(std::string_view json, const std::string& where);

/// The lens of a photo that is width x height px, a size that counts where the file declares none.
/// Throws Error where there is neither a focal length nor an angle, or the camera model cannot be
/// read.
LensModel lens_from_transforms(const TransformsIntrinsics& intrinsics, int width, int height,
                               const std::string& where);

}  // namespace darb
