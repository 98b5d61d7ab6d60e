// SPDX-License-Identifier: MIT
// COLMAP models, binary and text, as the files state them. Format: colmap.github.io/format.html.
// Every function throws Error(where and record, reason), and allocates no more than the size of the
// file justifies.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/data/dataset.h"

namespace darb {

struct ColmapImage {
    std::uint32_t id = 0;
    std::uint32_t camera_id = 0;
    std::string name;
    glm::dmat3 rotation{1.0};  // world to camera
    glm::dvec3 translation{0.0};
    std::vector<float> observed;  // [][2] px, where the image's keypoints are
};

/// A rotation followed by a translation.
struct ColmapPose {
    glm::dmat3 rotation{1.0};
    glm::dvec3 translation{0.0};
};

/// The pose of each camera in its rig, by rig id and camera id; empty where it is not known.
using ColmapRigs = std::map<std::uint32_t, std::map<std::uint32_t, std::optional<ColmapPose>>>;

/// What the cameras of a rig recorded at one moment.
struct ColmapFrame {
    std::uint32_t id = 0, rig = 0;
    ColmapPose pose;                                // world to rig
    std::map<std::uint64_t, std::uint32_t> images;  // camera id by image id
};

using ColmapCameras = std::map<std::uint32_t, LensModel>;

struct ColmapModel {
    bool binary = true;
    ColmapCameras cameras;
    std::vector<ColmapImage> images;  // in file order
    PointCloud points;                // empty where the model has no points3D file
    std::size_t dropped_points = 0;   // points left out because they are NaN or infinite
    std::vector<std::string> notes;   // one sentence each: which of two conflicting sources was
                                      // read, and remarks on the points of a points3D.ply
};

ColmapCameras parse_colmap_cameras(std::span<const std::byte> file, const std::string& where);
std::vector<ColmapImage> parse_colmap_images(std::span<const std::byte> file,
                                             const std::string& where);
/// observations: for each entry of the points' seen_by, its number among the image's observations.
PointCloud parse_colmap_points(std::span<const std::byte> file, const std::string& where,
                               std::size_t& dropped,
                               std::vector<std::uint32_t>* observations = nullptr);

ColmapCameras parse_colmap_cameras_text(std::string_view file, const std::string& where);
std::vector<ColmapImage> parse_colmap_images_text(std::string_view file, const std::string& where);
PointCloud parse_colmap_points_text(std::string_view file, const std::string& where,
                                    std::size_t& dropped,
                                    std::vector<std::uint32_t>* observations = nullptr);

ColmapRigs parse_colmap_rigs(std::span<const std::byte> file, const std::string& where);
ColmapRigs parse_colmap_rigs_text(std::string_view file, const std::string& where);
std::vector<ColmapFrame> parse_colmap_frames(std::span<const std::byte> file,
                                             const std::string& where);
std::vector<ColmapFrame> parse_colmap_frames_text(std::string_view file, const std::string& where);

/// Whether the folder holds cameras and images, as .bin or .txt.
bool is_colmap_model(const std::filesystem::path& folder);

/// The number of images in a model, for display; 0 where the file cannot be read.
std::size_t count_colmap_images(const std::filesystem::path& folder);

/// Reads the binary files where the text files exist as well. Every image's camera exists, and
/// there is at least one image. Points come from the model, unless a points3D.ply beside it holds a
/// different number: then somebody put it there, whereas 3DGS leaves one with the same points.
/// Where the model has rigs and frames (COLMAP 3.12 and later), they determine the poses of images
/// as they do in COLMAP: world to rig, then rig to camera. A note says where the images state other
/// poses.
ColmapModel read_colmap(const std::filesystem::path& folder);

// Writes a small COLMAP model: cameras.bin, images.bin and points3D.bin, as COLMAP and common
// trainers read them. Used by scene generators and tests.

/// folder: made where missing (for a data set at D, pass D/sparse/0; photos go to D/images/NAME).
/// Each view's camera is written as a PINHOLE at its own size, and the view's name as the image's
/// name; equal intrinsics share one camera. Observations and tracks are empty. Throws Error as
/// write_file_atomic does.
void write_colmap_binary(const std::filesystem::path& folder, const std::vector<View>& views,
                         const PointCloud& points);

}  // namespace darb
