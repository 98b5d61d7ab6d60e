// COLMAP models, binary and text, as the files state them. Format: colmap.github.io/format.html.
// Every function throws Error(where and record, reason) and allocates nothing that the file's own
// size does not back.
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
    std::vector<float> observed;  // [][2] px
};

/// A rotation and a translation that follows it.
struct ColmapPose {
    glm::dmat3 rotation{1.0};
    glm::dvec3 translation{0.0};
};

/// By rig and camera: its pose as the rig sees it; nothing where it is not known.
using ColmapRigs = std::map<std::uint32_t, std::map<std::uint32_t, std::optional<ColmapPose>>>;

/// What the cameras of a rig took at one moment.
struct ColmapFrame {
    std::uint32_t id = 0, rig = 0;
    ColmapPose pose;                                // world to rig
    std::map<std::uint64_t, std::uint32_t> images;  // image id to camera id
};

using ColmapCameras = std::map<std::uint32_t, LensModel>;

struct ColmapModel {
    bool binary = true;
    ColmapCameras cameras;
    std::vector<ColmapImage> images;  // in file order
    PointCloud points;                // empty where the model has no points3D file
    std::size_t dropped_points = 0;   // NaN or infinite
    std::vector<std::string> notes;  // which of two sources of one fact was read, and on the points
                                     // of a points3D.ply, a sentence each
};

ColmapCameras parse_colmap_cameras(std::span<const std::byte> file, const std::string& where);
std::vector<ColmapImage> parse_colmap_images(std::span<const std::byte> file,
                                             const std::string& where);
/// observations: for each of the points' seen_by its number among those of the image.
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

/// Whether the folder holds cameras and images, .bin or .txt.
bool is_colmap_model(const std::filesystem::path& folder);

/// Images of a model, for people: 0 where the file cannot be read.
std::size_t count_colmap_images(const std::filesystem::path& folder);

/// Binary where both are there. Every image's camera exists and there is at least one image. Points
/// are those of the model, unless a points3D.ply beside them holds another number: somebody put it
/// there, while 3DGS leaves one of the same points. Where the model has rigs and frames
/// (COLMAP 3.12 and later), these say the poses of images, as in COLMAP: world to rig, then rig to
/// camera; a note tells where images say otherwise.
ColmapModel read_colmap(const std::filesystem::path& folder);

}  // namespace darb
