// transforms.json as a data set: photos, masks, the point cloud and the test files.
#include <fmt/format.h>

#include <set>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/data/image_io.h"
#include "engine/data/point_cloud_ply.h"
#include "engine/data/source.h"
#include "engine/data/transforms.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

constexpr int kSyntheticSize = 800;  // px, of NeRF synthetic; only where no photo tells

constexpr std::string_view kImages = "images/";

/// "./train/r_2" and ".\train\r_2" to "train/r_2".
std::string plain_name(const std::string& file_path) {
    return fs::path(with_slashes(file_path)).lexically_normal().generic_string();
}

/// With images/ replaced by the folder that the options ask for.
std::string asked_name(const std::string& name, const DatasetOptions& options) {
    if (options.images_folder != "images" && name.starts_with(kImages))
        return options.images_folder + "/" + name.substr(kImages.size());
    return name;
}

/// The lens; a file without a size takes the turned photo's.
void set_lens(const TransformsFrame& frame, const std::string& where, View& view) {
    int width = kSyntheticSize, height = kSyntheticSize;
    if ((!frame.intrinsics.w || !frame.intrinsics.h) && fs::is_regular_file(view.photo)) {
        const ImageInfo info = read_image_info(view.photo);
        view.orientation = info.orientation;
        width = info.orientation >= 5 ? info.height : info.width;
        height = info.orientation >= 5 ? info.width : info.height;
    }
    view.lens = lens_from_transforms(frame.intrinsics, width, height,
                                     fmt::format("{} ({})", where, frame.file_path));
}

struct Skipped {
    std::size_t count = 0;
    std::string first;
    std::size_t in_images = 0;  // of all frames, those under images/
};

void add_frames(const fs::path& json, bool is_test, const DatasetOptions& options, Dataset& dataset,
                Skipped& skipped, std::string& ply) {
    const TransformsFile file = parse_transforms(read_text_file(json), json.string());
    if (ply.empty()) ply = file.ply_file_path;
    const fs::path root = json.parent_path();
    std::set<std::string> test_names;
    for (const std::string& name : file.test_filenames) test_names.insert(plain_name(name));
    for (const TransformsFrame& frame : file.frames) {
        View view;
        view.name = plain_name(frame.file_path);
        skipped.in_images += view.name.starts_with(kImages) ? 1 : 0;
        const std::string name = asked_name(view.name, options);
        const fs::path wanted = root / name;
        view.photo = find_photo(root, name);
        if (view.photo.empty() && name == view.name)  // backslashes that are part of a name
            view.photo = find_photo(root, frame.file_path);
        if (view.photo.empty()) {
            if (options.require_photos) {
                if (skipped.count++ == 0) skipped.first = wanted.string();
                continue;
            }
            view.photo = wanted;
        }
        if (!frame.mask_path.empty()) view.mask = root / frame.mask_path;
        if (!view.mask.empty() && !fs::is_regular_file(view.mask))
            view.mask = root / with_slashes(frame.mask_path);
        if (options.require_photos && !view.mask.empty() && !fs::is_regular_file(view.mask))
            throw Error(fmt::format("{} ({})", json.string(), frame.file_path),
                        fmt::format("its mask {} is missing", view.mask.string()),
                        "Put the mask back or remove mask_path.");
        set_lens(frame, json.string(), view);
        view.camera.rotation = frame.rotation;
        view.camera.translation = frame.translation;
        view.is_test = is_test || test_names.contains(view.name);
        dataset.views.push_back(std::move(view));
    }
}

void add_points(const fs::path& root, const std::string& ply, const DatasetOptions& options,
                Dataset& dataset) {
    const fs::path path = ply.empty() ? root / "points3D.ply" : root / ply;
    if (!fs::is_regular_file(path)) {
        if (!options.require_photos) return;  // only cameras are wanted
        dataset.notes.push_back(
            ply.empty() ? "There are no sparse points; training starts from random ones."
                        : fmt::format("The point cloud {} is missing; training starts from random "
                                      "points.",
                                      path.string()));
        return;
    }
    std::size_t dropped = 0;
    dataset.points = read_point_cloud_ply(path, dropped);
    if (dropped > 0)
        dataset.notes.push_back(
            fmt::format("{} with NaN or infinity were dropped.", counted(dropped, "point")));
}

}  // namespace

Dataset load_transforms(const fs::path& path, const DatasetOptions& options) {
    Dataset dataset;
    Skipped skipped;
    std::string ply;
    dataset.root = fs::is_directory(path) ? path : path.parent_path();
    fs::path json = path;
    if (fs::is_directory(path)) {
        const bool split = fs::exists(path / "transforms_train.json");
        json = path / (split ? "transforms_train.json" : "transforms.json");
    }
    dataset.source = json.filename().string();
    add_frames(json, false, options, dataset, skipped, ply);
    if (fs::is_directory(path) && json.filename() == "transforms_train.json") {
        const bool has_test = fs::exists(path / "transforms_test.json");
        const bool has_val = fs::exists(path / "transforms_val.json");
        if (has_test || has_val)
            add_frames(path / (has_test ? "transforms_test.json" : "transforms_val.json"), true,
                       options, dataset, skipped, ply);
        if (has_test && has_val)
            dataset.notes.push_back(
                "transforms_val.json was not read: transforms_test.json is the "
                "test set.");
    }
    if (dataset.views.empty())
        throw Error(json.string(),
                    skipped.count == 0
                        ? "lists no frames"
                        : fmt::format("none of its {} photos is there, the first being {}",
                                      skipped.count, skipped.first),
                    "Put the photos where file_path says, relative to the file.");
    if (skipped.count > 0)
        dataset.notes.push_back(
            fmt::format("Skipped: {} whose photo is missing, the first being {}.",
                        counted(skipped.count, "frame"), skipped.first));
    if (options.images_folder != "images" && skipped.in_images == 0)
        dataset.notes.push_back(
            fmt::format("--images {} has no effect: no file_path in {} begins with images/. Use "
                        "-r to scale.",
                        options.images_folder, json.filename().string()));
    add_points(dataset.root, ply, options, dataset);
    return dataset;
}

}  // namespace darb
