// transforms.json as the file states it: NeRF synthetic, instant-ngp and nerfstudio. No file
// access. Keys that would change the meaning and are not read become notes.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/data/dataset.h"

namespace darb {

/// What a frame, or the file for all frames, declares.
struct TransformsIntrinsics {
    std::optional<double> w, h, fl_x, fl_y, cx, cy;        // px
    std::optional<double> camera_angle_x, camera_angle_y;  // rad
    std::array<double, 6> k{};                             // k1 to k6
    double p1 = 0, p2 = 0;
    std::string camera_model;        // nerfstudio's name; empty where there is none
    std::optional<bool> is_fisheye;  // instant-ngp
    double crop_radius = 0;          // px from the middle that count; 0: all (nerfstudio)
};

struct TransformsFrame {
    std::string file_path;   // as written
    std::string mask_path;   // may be empty
    std::string depth_path;  // depth_file_path or instant-ngp's depth_path, may be empty
    TransformsIntrinsics intrinsics;
    glm::dmat3 rotation{1.0};  // world to camera, COLMAP's axes
    glm::dvec3 translation{0.0};
};

struct TransformsFile {
    std::vector<TransformsFrame> frames;
    std::string ply_file_path;  // may be empty
    // Metres a step: depth_unit_scale_factor (nerfstudio), which is of all depths, or
    // integer_depth_scale (instant-ngp), which is of integers alone; 0: not declared.
    double depth_unit = 0;
    bool unit_of_integers = false;
    bool read_depths = true;   // enable_depth_loading
    double applied_scale = 1;  // world units of the file a metre, which the writer scaled poses by
    // nerfstudio's split, may be empty; val_filenames where test_filenames is empty.
    std::vector<std::string> train_filenames, test_filenames;
    std::size_t scaled_poses = 0;    // whose rotation had a scale
    std::vector<std::string> notes;  // a sentence each
};

/// transform_matrix is camera to world with OpenGL's camera axes (y up, looking down -z).
/// nerfstudio's applied_transform has been applied by the writer to the frames and to the ply
/// alike, so both stay in the file's frame; so do instant-ngp's scale and offset, which it applies
/// when it reads. Numbers may be strings, and rotations have a scale. Throws Error(where and frame,
/// reason), also where two keys for one fact have different values.
TransformsFile parse_transforms(std::string_view json, const std::string& where);

/// The lens for a photo of width x height px, used where the file declares no size. Throws Error
/// where there is neither a focal length nor an angle, or the camera model cannot be read.
LensModel lens_from_transforms(const TransformsIntrinsics& intrinsics, int width, int height,
                               const std::string& where);

}  // namespace darb
