// A COLMAP project as a data set: model, photos and masks.
#include <fmt/format.h>

#include <map>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/data/colmap.h"
#include "engine/data/depths.h"
#include "engine/data/masks.h"
#include "engine/data/source.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

/// The remedy where a photo is in another folder of the project: its name; else empty.
std::string folder_that_has(const fs::path& root, const std::string& name) {
    for (const fs::path& folder : folders_of(root))
        if (!find_photo(folder, name).empty() || !find_by_end(folder, name).empty())
            return folder.filename().string();
    return {};
}

/// Beside the model or above it, within root; for a model folder given directly (or the folder of
/// models that it is in) up to two folders above that, too. Where no folder has the name images,
/// that of those which holds the photo `name`.
fs::path find_images_folder(const fs::path& root, const fs::path& model_folder,
                            const std::string& name, const DatasetOptions& options) {
    const fs::path base = tidy_path(fs::absolute(root)),
                   model = tidy_path(fs::absolute(model_folder));
    std::vector<fs::path> parents{base};
    if (model == base || model == base / "0")
        parents.insert(parents.end(), {base.parent_path(), base.parent_path().parent_path()});
    for (fs::path folder = model; folder != base; folder = folder.parent_path())
        parents.push_back(folder);
    for (const fs::path& parent : parents)
        if (fs::is_directory(parent / options.images_folder)) return parent / options.images_folder;
    if (options.images_folder == "images")  // the photos lie beside the model, or above it
        for (const fs::path& parent : parents)
            if (!find_photo(parent, name).empty() || !find_by_end(parent, name).empty())
                return parent;
    if (!options.require_photos) return root / options.images_folder;
    const std::string scaled = scaled_images(base), other = folder_that_has(base, name);
    throw Error((root / options.images_folder).string(), "the folder of the photos is missing",
                options.images_folder != "images" && fs::is_directory(base / "images")
                    ? "Use --images images with -r 2, 4 or 8 to scale at load."
                : scaled.empty() && !other.empty()
                    ? fmt::format("Put the photos there, or name their folder: --images {}.", other)
                : scaled.empty() ? "Put the photos there, or name their folder with --images."
                                 : fmt::format("Put the photos there, or take those of another "
                                               "size with --images {}.",
                                               scaled));
}

/// What else a mapper made beside the model 0: pieces that do not hang together with it.
void note_siblings(const fs::path& model_folder, std::size_t photos, Dataset& dataset) {
    if (model_folder.filename() != "0") return;
    std::map<fs::path, std::size_t> others;
    for (const fs::directory_entry& entry : fs::directory_iterator(model_folder.parent_path()))
        if (entry.path() != model_folder && is_colmap_model(entry.path()))
            others[entry.path()] = count_colmap_images(entry.path());
    if (others.empty()) return;
    std::string list;
    for (const auto& [path, count] : others)
        list += fmt::format("{}{} of {}", list.empty() ? "" : ", ", path.filename().string(),
                            counted(count, "photo"));
    dataset.notes.push_back(
        fmt::format("{}, of {}, was read; other pieces of the reconstruction lie beside it: {}. To "
                    "use one, name its folder.",
                    model_folder.string(), counted(photos, "photo"), list));
}

/// Photos that are not there by their whole names: by the end of these.
void find_photos_by_end(const fs::path& images, const std::string& listing, Dataset& dataset) {
    std::map<fs::path, std::string> used;
    for (const View& view : dataset.views)
        if (!view.photo.empty()) used.emplace(view.photo, view.name);
    std::size_t found = 0;
    std::string example;
    for (View& view : dataset.views) {
        if (!view.photo.empty()) continue;
        const fs::path photo = find_by_end(images, view.name);
        if (photo.empty()) continue;
        const auto [at, is_new] = used.emplace(photo, view.name);
        if (!is_new)
            throw Error(fmt::format("{}, {}", listing, view.name),
                        fmt::format("is not there, and by the end of its name it is {}, the photo "
                                    "of {} as well",
                                    photo.string(), at->second),
                        "Put the photos into the folders that the names have, or name the folder "
                        "that has these with --images.");
        if (found++ == 0)
            example = fmt::format("{} is {}", view.name, photo.lexically_relative(images).string());
        view.photo = photo;
        view.name = photo.lexically_relative(images).generic_string();
    }
    if (found > 0)
        dataset.notes.push_back(fmt::format("Found in {} by the end of their names: {}, as {}.",
                                            images.string(), counted(found, "photo"), example));
}

void check_photos(const std::vector<View>& views, const fs::path& root,
                  const fs::path& model_folder) {
    std::size_t missing = 0;
    const View* first = nullptr;
    for (const View& view : views) {
        check_is_file(view.photo);  // where it is there
        if (!fs::is_regular_file(view.photo) && missing++ == 0) first = &view;
    }
    const std::string other = first ? folder_that_has(root, first->name) : "";
    if (first)
        throw Error(first->photo.string(),
                    fmt::format("the photo is missing, and with it {} of the {} that {} lists",
                                missing, views.size(), model_folder.string()),
                    fmt::format("Put the photos back, name their folder with --images{}, or take "
                                "them out of the model with colmap image_deleter.",
                                other.empty() ? "" : " " + other));
}

}  // namespace

Dataset load_colmap(const fs::path& root, const fs::path& model_folder,
                    const DatasetOptions& options) {
    ColmapModel model = read_colmap(model_folder);
    Dataset dataset;
    dataset.root = root;
    dataset.source = model.binary ? "COLMAP binary" : "COLMAP text";
    const fs::path images =
        find_images_folder(root, model_folder, model.images.front().name, options);
    for (const ColmapImage& image : model.images) {
        View view;
        view.name = image.name;
        view.source_id = image.id;
        view.photo = find_photo(images, image.name);
        view.lens = model.cameras.at(image.camera_id);
        view.camera.rotation = image.rotation;
        view.camera.translation = image.translation;
        dataset.views.push_back(std::move(view));
    }
    find_photos_by_end(images, model_folder.string(), dataset);
    for (View& view : dataset.views)
        if (view.photo.empty()) view.photo = images / view.name;
    if (options.require_photos) check_photos(dataset.views, root, model_folder);
    // Beside the folder of the photos; where they lie with the model, that is the folder itself.
    const bool with_model = images.filename() != fs::path(options.images_folder).filename();
    const fs::path around = with_model ? images : images.parent_path();
    add_masks(around, options, dataset);
    add_depths(around, images, options, dataset);
    dataset.points = std::move(model.points);
    dataset.notes.insert(dataset.notes.end(), model.notes.begin(), model.notes.end());
    if (model.dropped_points > 0)
        dataset.notes.push_back(fmt::format("{} with NaN or infinity were dropped.",
                                            counted(model.dropped_points, "point")));
    note_siblings(model_folder, dataset.views.size(), dataset);
    return dataset;
}

}  // namespace darb
