// A COLMAP model folder: picks binary or text, reads all three files, checks that they fit.
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/data/colmap.h"
#include "engine/data/point_cloud_ply.h"

namespace darb {

namespace {

bool has_pair(const std::filesystem::path& folder, const char* extension) {
    return std::filesystem::is_regular_file(folder / (std::string("cameras") + extension)) &&
           std::filesystem::is_regular_file(folder / (std::string("images") + extension));
}

// Where each image saw the points of its tracks, as shares of its sides.
void locate_tracks(const std::vector<std::uint32_t>& observations, ColmapModel& model) {
    std::map<std::uint32_t, const ColmapImage*> images;
    for (const ColmapImage& image : model.images) images[image.id] = &image;
    PointCloud& points = model.points;
    std::size_t located = 0;
    std::vector<float> at(2 * points.seen_by.size(), std::numeric_limits<float>::quiet_NaN());
    for (std::size_t k = 0; k < points.seen_by.size(); ++k) {
        const auto image = images.find(points.seen_by[k]);
        const std::size_t number = observations[k];
        if (image == images.end() || number >= image->second->observed.size() / 2) continue;
        const auto camera = model.cameras.find(image->second->camera_id);
        if (camera == model.cameras.end()) continue;
        const LensModel& lens = camera->second;
        at[2 * k] = image->second->observed[2 * number] / static_cast<float>(lens.width);
        at[2 * k + 1] = image->second->observed[2 * number + 1] / static_cast<float>(lens.height);
        ++located;
    }
    if (located > 0) points.seen_at = std::move(at);
}

void read_points(const std::filesystem::path& folder, ColmapModel& model) {
    const auto binary = folder / "points3D.bin", text = folder / "points3D.txt",
               ply = folder / "points3D.ply";
    const bool has_binary = model.binary && std::filesystem::is_regular_file(binary);
    const bool has_own = has_binary || std::filesystem::is_regular_file(text);
    std::vector<std::uint32_t> observations;
    if (has_binary)
        model.points = parse_colmap_points(read_file(binary), binary.string(), model.dropped_points,
                                           &observations);
    else if (has_own)
        model.points = parse_colmap_points_text(read_text_file(text), text.string(),
                                                model.dropped_points, &observations);
    if (has_own) locate_tracks(observations, model);
    if (!std::filesystem::is_regular_file(ply)) return;
    std::size_t dropped = 0;
    std::vector<std::string> notes;
    PointCloud points = read_point_cloud_ply(ply, dropped, &notes);
    const std::size_t own = model.points.size() + model.dropped_points;
    if (points.size() + dropped == own) return;
    if (has_own)
        notes.push_back(fmt::format("{} was read, {} points, in place of the {} of {}.",
                                    ply.string(), points.size() + dropped, own,
                                    (has_binary ? binary : text).filename().string()));
    model.notes.insert(model.notes.end(), notes.begin(), notes.end());
    model.points = std::move(points);
    model.dropped_points = dropped;
}

}  // namespace

namespace {

/// Whether two poses are one, but for what a text file rounds off.
bool same_pose(const ColmapPose& a, const ColmapPose& b) {
    constexpr double kRounding = 1e-5;
    double apart = 0;
    for (int c = 0; c < 3; ++c)
        apart = std::max(apart, glm::distance(a.rotation[c], b.rotation[c]));
    return apart < kRounding && glm::distance(a.translation, b.translation) <
                                    kRounding * (1 + glm::length(a.translation));
}

std::string centre_of(const ColmapPose& pose) {
    const glm::dvec3 c = -(glm::transpose(pose.rotation) * pose.translation);
    return fmt::format("{:.4g}, {:.4g}, {:.4g}", c.x + 0.0, c.y + 0.0, c.z + 0.0);  // no -0
}

/// Gives images the poses of their frames and rigs, which COLMAP takes for the truth, too.
void pose_by_rigs(const ColmapRigs& rigs, const std::vector<ColmapFrame>& frames,
                  const std::filesystem::path& listing, ColmapModel& model) {
    std::map<std::uint64_t, const ColmapFrame*> frame_of;
    for (const ColmapFrame& frame : frames)
        for (const auto& [image, camera] : frame.images) frame_of[image] = &frame;
    std::size_t changed = 0, unknown = 0;
    std::string example, first_unknown;
    for (ColmapImage& image : model.images) {
        const std::string where =
            fmt::format("{}, image {} ({})", listing.string(), image.id, image.name);
        const auto at = frame_of.find(image.id);
        if (at == frame_of.end()) {
            if (unknown++ == 0) first_unknown = image.name;
            continue;
        }
        const ColmapFrame& frame = *at->second;
        const std::uint32_t camera = frame.images.at(image.id);
        if (camera != image.camera_id)
            throw Error(where,
                        fmt::format("is of camera {}, but of camera {} in frame {}",
                                    image.camera_id, camera, frame.id),
                        "The files belong to different models: copy all of one model.");
        const auto rig = rigs.find(frame.rig);
        if (rig == rigs.end() || !rig->second.contains(camera))
            throw Error(where,
                        fmt::format("its frame {} is of rig {}, which has no camera {}", frame.id,
                                    frame.rig, camera),
                        "The files belong to different models: copy all of one model.");
        const std::optional<ColmapPose>& sensor = rig->second.at(camera);
        if (!sensor) continue;  // not calibrated: the image's own pose is all there is
        const ColmapPose own{image.rotation, image.translation},
            composed{sensor->rotation * frame.pose.rotation,
                     sensor->rotation * frame.pose.translation + sensor->translation};
        if (same_pose(own, composed)) continue;
        if (changed++ == 0)
            example =
                fmt::format("{} at {}, not at {}", image.name, centre_of(composed), centre_of(own));
        image.rotation = composed.rotation;
        image.translation = composed.translation;
    }
    if (changed > 0)
        model.notes.push_back(
            fmt::format("Warning: {} of {} poses in {} are not those of its frames and rigs, which "
                        "were used, as "
                        "COLMAP does: {}. If the images are right, remove rigs and frames.",
                        changed, model.images.size(), listing.string(), example));
    if (unknown > 0)
        model.notes.push_back(fmt::format(
            "Warning: {} of {} images of {} are in no frame, the first being {}: their own poses "
            "were used.",
            unknown, model.images.size(), listing.string(), first_unknown));
}

void read_rigs(const std::filesystem::path& folder, ColmapModel& model) {
    const char* extension = model.binary ? ".bin" : ".txt";
    const auto rigs = folder / (std::string("rigs") + extension),
               frames = folder / (std::string("frames") + extension),
               images = folder / (std::string("images") + extension);
    if (!std::filesystem::is_regular_file(rigs) || !std::filesystem::is_regular_file(frames))
        return;
    const auto poses = model.binary
                           ? parse_colmap_frames(read_file(frames), frames.string())
                           : parse_colmap_frames_text(read_text_file(frames), frames.string());
    pose_by_rigs(model.binary ? parse_colmap_rigs(read_file(rigs), rigs.string())
                              : parse_colmap_rigs_text(read_text_file(rigs), rigs.string()),
                 poses, images, model);
}

}  // namespace

bool is_colmap_model(const std::filesystem::path& folder) {
    return has_pair(folder, ".bin") || has_pair(folder, ".txt");
}

std::size_t count_colmap_images(const std::filesystem::path& folder) {
    try {
        if (has_pair(folder, ".bin")) {
            std::uint64_t count = 0;  // the head of the file
            const std::vector<std::byte> head = read_file_head(folder / "images.bin", sizeof count);
            if (head.size() == sizeof count) std::memcpy(&count, head.data(), sizeof count);
            return count;
        }
        const auto images = folder / "images.txt";
        return parse_colmap_images_text(read_text_file(images), images.string()).size();
    } catch (const Error&) {
        return 0;
    }
}

ColmapModel read_colmap(const std::filesystem::path& folder) {
    ColmapModel model;
    model.binary = has_pair(folder, ".bin");
    const auto cameras = folder / (model.binary ? "cameras.bin" : "cameras.txt");
    const auto images = folder / (model.binary ? "images.bin" : "images.txt");
    if (model.binary) {
        model.cameras = parse_colmap_cameras(read_file(cameras), cameras.string());
        model.images = parse_colmap_images(read_file(images), images.string());
    } else {
        model.cameras = parse_colmap_cameras_text(read_text_file(cameras), cameras.string());
        model.images = parse_colmap_images_text(read_text_file(images), images.string());
    }
    if (model.images.empty())
        throw Error(
            images.string(), "the model holds no images",
            "The reconstruction failed: run colmap again, with more overlap or other matching.");
    for (const ColmapImage& image : model.images)
        if (!model.cameras.contains(image.camera_id))
            throw Error(fmt::format("{}, image {} ({})", images.string(), image.id, image.name),
                        fmt::format("its camera id {} is not in {}", image.camera_id,
                                    cameras.filename().string()),
                        "The files belong to different models: copy all of one model.");
    read_rigs(folder, model);
    read_points(folder, model);
    return model;
}

}  // namespace darb
