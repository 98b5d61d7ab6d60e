// transforms.json as a data set: photos, masks, the point cloud and the test files.
#include <fmt/format.h>

#include <map>
#include <set>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/data/depths.h"
#include "engine/data/image_io.h"
#include "engine/data/masks.h"
#include "engine/data/point_cloud_ply.h"
#include "engine/data/source.h"
#include "engine/data/transforms.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

constexpr int kSyntheticSize = 800;  // px, of NeRF synthetic; only where no photo tells

// Of the sparse points where ply_file_path is absent: of 3DGS, BlenderNeRF and nerfstudio.
constexpr const char* kPointFiles[] = {"points3d.ply", "points3D.ply", "sparse_pc.ply",
                                       "pointcloud.ply"};

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

bool in_pixels(const TransformsIntrinsics& in) {
    return in.fl_x || in.fl_y || in.cx || in.cy;
}

/// The lens; a file without a size takes that of its own photo, turned, whichever is loaded.
void set_lens(const TransformsFrame& frame, const fs::path& listing, const DatasetOptions& options,
              View& view) {
    const std::string where = fmt::format("{} ({})", listing.string(), frame.file_path);
    int width = kSyntheticSize, height = kSyntheticSize;
    if ((!frame.intrinsics.w || !frame.intrinsics.h) && fs::is_regular_file(view.photo)) {
        fs::path own = view.photo;
        if (asked_name(view.name, options) != view.name && in_pixels(frame.intrinsics))
            own = find_photo(listing.parent_path(), view.name);
        if (own.empty())
            throw Error(where,
                        fmt::format("its camera is in pixels of {}, which is missing, and declares "
                                    "no size",
                                    view.name),
                        "Add w and h to the file, or put those photos back.");
        const ImageInfo info = read_image_info(own);
        view.orientation = read_image_info(view.photo).orientation;
        width = info.orientation >= 5 ? info.height : info.width;
        height = info.orientation >= 5 ? info.width : info.height;
    }
    view.lens = lens_from_transforms(frame.intrinsics, width, height, where);
}

void set_depth(const TransformsFrame& frame, const TransformsFile& declared, const fs::path& file,
               const DatasetOptions& options, View& view) {
    view.depth_unit = declared.depth_unit;
    view.depth_unit_of_integers = declared.unit_of_integers;
    if (frame.depth_path.empty() || !declared.read_depths) return;
    view.depth = file.parent_path() / frame.depth_path;
    if (!fs::is_regular_file(view.depth))
        view.depth = file.parent_path() / with_slashes(frame.depth_path);
    if (options.require_photos && !fs::is_regular_file(view.depth))
        throw Error(fmt::format("{} ({})", file.string(), frame.file_path),
                    fmt::format("its depth {} is missing", view.depth.string()),
                    "Put the depth back, or remove its name from the frame.");
}

struct Skipped {
    std::size_t count = 0;
    std::string first;
    std::size_t in_images = 0;  // of all frames, those under images/
};

/// What the files declare beside frames.
struct Declared {
    std::string ply;
    bool masks = false;  // of some frame
    bool depths = false;
    bool no_depths = false;  // they are not to be read
    std::size_t scaled_poses = 0;
    std::map<fs::path, std::string> by_end;  // photos found by the end of these names
    std::size_t of_no_split = 0;             // frames that the split leaves out
    std::size_t unknown_names = 0;           // of the split, which no frame has
};

/// By the end of its name, beside the file or in its folder of images.
fs::path find_frame_by_end(const fs::path& root, const std::string& name, Declared& declared) {
    fs::path photo = find_by_end(root, name);
    if (photo.empty()) photo = find_by_end(root / kImages, "/" + name);
    if (photo.empty()) return {};
    if (!declared.by_end.emplace(photo, name).second)
        throw Error(fmt::format("{} ({})", root.string(), name),
                    fmt::format("is not there, and by the end of its name it is {}, the photo of "
                                "{} as well",
                                photo.string(), declared.by_end.at(photo)),
                    "Put the photos where file_path says, relative to the file.");
    return photo;
}

std::set<std::string> names_of_split(const std::vector<std::string>& listed,
                                     const TransformsFile& file, Declared& declared) {
    std::set<std::string> frames, names;
    for (const TransformsFrame& frame : file.frames) frames.insert(plain_name(frame.file_path));
    for (const std::string& name : listed) {
        names.insert(plain_name(name));
        declared.unknown_names += frames.contains(plain_name(name)) ? 0 : 1;
    }
    return names;
}

/// What the split and the poses of the files were found to be.
void note_declared(const Declared& declared, Dataset& dataset) {
    if (declared.scaled_poses > 0)
        dataset.notes.push_back(fmt::format("The scale of the rotation was removed: {}.",
                                            counted(declared.scaled_poses, "pose")));
    if (!declared.by_end.empty())
        dataset.notes.push_back(fmt::format("Found by the end of their names: {}, as {} for {}.",
                                            counted(declared.by_end.size(), "photo"),
                                            declared.by_end.begin()->first.string(),
                                            declared.by_end.begin()->second));
    if (declared.of_no_split > 0)
        dataset.notes.push_back(
            fmt::format("Left out: {} that train_filenames does not list, nor the test set.",
                        counted(declared.of_no_split, "frame")));
    if (declared.unknown_names > 0)
        dataset.notes.push_back(
            fmt::format("Warning: the split lists {} that are no frame's file_path.",
                        counted(declared.unknown_names, "name")));
    if (declared.no_depths)
        dataset.notes.push_back(
            "Depths were not read, as enable_depth_loading is false in the file.");
    const auto cropped =
        std::ranges::find_if(dataset.views, [](const View& view) { return view.crop_radius > 0; });
    if (cropped != dataset.views.end())
        dataset.notes.push_back(
            fmt::format("Pixels more than {:g} px from the middle of a photo are left out, as "
                        "fisheye_crop_radius says.",
                        cropped->crop_radius));
}

void add_frames(const fs::path& listing, bool is_test, const DatasetOptions& options,
                Dataset& dataset, Skipped& skipped, Declared& declared) {
    const TransformsFile file = parse_transforms(read_text_file(listing), listing.string());
    if (declared.ply.empty()) declared.ply = file.ply_file_path;
    declared.scaled_poses += file.scaled_poses;
    const fs::path root = listing.parent_path();
    const std::set<std::string> test_names = names_of_split(file.test_filenames, file, declared),
                                train_names = names_of_split(file.train_filenames, file, declared);
    dataset.depth_scale = file.applied_scale;
    declared.no_depths |= !file.read_depths;
    dataset.notes.insert(dataset.notes.end(), file.notes.begin(), file.notes.end());
    for (const TransformsFrame& frame : file.frames) {
        View view;
        view.name = plain_name(frame.file_path);
        declared.masks |= !frame.mask_path.empty();
        declared.depths |= !frame.depth_path.empty();
        skipped.in_images += view.name.starts_with(kImages) ? 1 : 0;
        const std::string name = asked_name(view.name, options);
        const fs::path wanted = root / name;
        view.photo = find_photo(root, name);
        if (view.photo.empty() && name == view.name)  // backslashes that are part of a name
            view.photo = find_photo(root, frame.file_path);
        if (view.photo.empty()) view.photo = find_frame_by_end(root, name, declared);
        if (view.photo.empty()) {
            if (options.require_photos) {
                check_is_file(wanted);  // what is there is of another kind
                if (skipped.count++ == 0) skipped.first = wanted.string();
                continue;
            }
            view.photo = wanted;
        }
        if (!frame.mask_path.empty()) view.mask = root / frame.mask_path;
        if (!view.mask.empty() && !fs::is_regular_file(view.mask))
            view.mask = root / with_slashes(frame.mask_path);
        if (options.require_photos && !view.mask.empty() && !fs::is_regular_file(view.mask))
            throw Error(fmt::format("{} ({})", listing.string(), frame.file_path),
                        fmt::format("its mask {} is missing", view.mask.string()),
                        "Put the mask back or remove mask_path.");
        set_depth(frame, file, listing, options, view);
        set_lens(frame, listing, options, view);
        view.crop_radius = frame.intrinsics.crop_radius;
        view.camera.rotation = frame.rotation;
        view.camera.translation = frame.translation;
        view.is_test = is_test || test_names.contains(view.name);
        if (!train_names.empty() && !view.is_test && !train_names.contains(view.name)) {
            ++declared.of_no_split;
            continue;
        }
        if (declared.by_end.contains(view.photo))
            view.name = view.photo.lexically_relative(root).generic_string();
        dataset.views.push_back(std::move(view));
    }
}

void add_points(const fs::path& root, const std::string& ply, const DatasetOptions& options,
                Dataset& dataset) {
    fs::path path = root / (ply.empty() ? kPointFiles[0] : ply);
    for (const char* name : kPointFiles)
        if (ply.empty() && !fs::is_regular_file(path)) path = root / name;
    if (!fs::is_regular_file(path)) {
        if (options.require_photos && !ply.empty())  // else only cameras are wanted
            dataset.notes.push_back(fmt::format("The point cloud {} is missing.", path.string()));
        return;
    }
    std::size_t dropped = 0;
    dataset.points = read_point_cloud_ply(path, dropped, &dataset.notes);
    if (ply.empty())
        dataset.notes.push_back(fmt::format("{} with the sparse points was read: {}.",
                                            path.filename().string(),
                                            counted(dataset.points.size(), "point")));
    if (dropped > 0)
        dataset.notes.push_back(
            fmt::format("{} with NaN or infinity were dropped.", counted(dropped, "point")));
}

}  // namespace

Dataset load_transforms(const fs::path& path, const DatasetOptions& options) {
    Dataset dataset;
    Skipped skipped;
    Declared declared;
    dataset.root = fs::is_directory(path) ? path : path.parent_path();
    fs::path listing = path;
    if (fs::is_directory(path))
        for (const char* name : kTransformsFiles)
            if (listing == path && fs::exists(path / name)) listing = path / name;
    dataset.source = listing.filename().string();
    const bool test = dataset.source == "transforms_test.json";
    add_frames(listing, test, options, dataset, skipped, declared);
    if (fs::is_directory(path) && listing.filename() == "transforms_train.json") {
        const bool has_test = fs::exists(path / "transforms_test.json");
        const bool has_val = fs::exists(path / "transforms_val.json");
        if (has_test || has_val)
            add_frames(path / (has_test ? "transforms_test.json" : "transforms_val.json"), true,
                       options, dataset, skipped, declared);
        if (has_test && has_val)
            dataset.notes.push_back(
                "transforms_val.json was not read: transforms_test.json is the "
                "test set.");
    }
    if (dataset.views.empty()) {
        const std::string scaled = scaled_images(dataset.root);
        throw Error(listing.string(),
                    skipped.count == 0
                        ? "lists no frames"
                        : fmt::format("none of its {} photos is there, the first being {}",
                                      skipped.count, skipped.first),
                    "Put the photos where file_path says, relative to the file" +
                        (scaled.empty() ? "."
                                        : fmt::format(", or take those of another size with "
                                                      "--images {}.",
                                                      scaled)));
    }
    if (skipped.count > 0)
        dataset.notes.push_back(
            fmt::format("Skipped: {} whose photo is missing, the first being {}.",
                        counted(skipped.count, "frame"), skipped.first));
    if (options.images_folder != "images" && skipped.in_images == 0)
        dataset.notes.push_back(
            fmt::format("--images {} has no effect: no file_path in {} begins with images/. Use "
                        "-r to scale.",
                        options.images_folder, listing.filename().string()));
    note_declared(declared, dataset);
    if (!declared.masks) add_masks(dataset.root, options, dataset);
    if (!declared.depths && !declared.no_depths) {
        const fs::path& photo = dataset.views[0].photo;  // in images/ or in the like of it
        add_depths(dataset.root, photo.parent_path(), options, dataset);
    }
    add_points(dataset.root, declared.ply, options, dataset);
    return dataset;
}

}  // namespace darb
