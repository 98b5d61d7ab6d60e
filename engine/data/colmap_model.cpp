// A COLMAP model folder: picks binary or text, reads all three files, checks that they fit.
#include <fmt/format.h>

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

void read_points(const std::filesystem::path& folder, ColmapModel& model) {
    const auto binary = folder / "points3D.bin", text = folder / "points3D.txt",
               ply = folder / "points3D.ply";
    if (model.binary && std::filesystem::is_regular_file(binary))
        model.points =
            parse_colmap_points(read_file(binary), binary.string(), model.dropped_points);
    else if (std::filesystem::is_regular_file(text))
        model.points =
            parse_colmap_points_text(read_text_file(text), text.string(), model.dropped_points);
    else if (std::filesystem::is_regular_file(ply))
        model.points = read_point_cloud_ply(ply, model.dropped_points);
}

}  // namespace

bool is_colmap_model(const std::filesystem::path& folder) {
    return has_pair(folder, ".bin") || has_pair(folder, ".txt");
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
    read_points(folder, model);
    return model;
}

}  // namespace darb
