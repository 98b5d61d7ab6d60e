// A COLMAP project as a data set: model, photos and masks.
#include <fmt/format.h>

#include <algorithm>

#include "engine/core/error.h"
#include "engine/data/colmap.h"
#include "engine/data/source.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

/// NAME with another or a further extension, as colmap and its users name masks.
fs::path find_mask(const fs::path& folder, const std::string& name) {
    for (const std::string& one : {name, with_slashes(name)})
        for (const fs::path& candidate :
             {folder / (one + ".png"), folder / one, (folder / one).replace_extension(".png")})
            if (fs::is_regular_file(candidate)) return candidate;
    return {};
}

/// For a model folder given directly, photos may lie beside it or up to two folders above.
fs::path find_images_folder(const fs::path& root, const fs::path& model_folder,
                            const DatasetOptions& options) {
    const fs::path base = tidy_path(fs::absolute(root));
    for (const fs::path& parent :
         {base, base.parent_path(), base.parent_path().parent_path(),
          tidy_path(fs::absolute(model_folder)).parent_path().parent_path()})
        if (fs::is_directory(parent / options.images_folder)) return parent / options.images_folder;
    if (options.require_photos)
        throw Error((root / options.images_folder).string(), "the folder of the photos is missing",
                    options.images_folder == "images"
                        ? "Put the photos there, or name their folder with --images."
                        : "Use --images images with -r 2, 4 or 8 to scale at load.");
    return root / options.images_folder;
}

void check_photos(const std::vector<View>& views, const fs::path& model_folder) {
    std::size_t missing = 0;
    const View* first = nullptr;
    for (const View& view : views)
        if (!fs::is_regular_file(view.photo) && missing++ == 0) first = &view;
    if (first)
        throw Error(first->photo.string(),
                    fmt::format("the photo is missing, and with it {} of the {} that {} lists",
                                missing, views.size(), model_folder.string()),
                    "Put the photos back, or name their folder with --images.");
}

}  // namespace

Dataset load_colmap(const fs::path& root, const fs::path& model_folder,
                    const DatasetOptions& options) {
    ColmapModel model = read_colmap(model_folder);
    Dataset dataset;
    dataset.root = root;
    dataset.source = model.binary ? "COLMAP binary" : "COLMAP text";
    const fs::path images = find_images_folder(root, model_folder, options);
    const fs::path masks = images.parent_path() / "masks";
    const bool has_masks = fs::is_directory(masks);
    std::size_t without_mask = 0;
    for (const ColmapImage& image : model.images) {
        View view;
        view.name = image.name;
        view.source_id = image.id;
        view.photo = find_photo(images, image.name);
        if (view.photo.empty()) view.photo = images / image.name;
        if (has_masks) view.mask = find_mask(masks, image.name);
        without_mask += view.mask.empty() ? 1 : 0;
        view.lens = model.cameras.at(image.camera_id);
        view.camera.rotation = image.rotation;
        view.camera.translation = image.translation;
        dataset.views.push_back(std::move(view));
    }
    if (options.require_photos) check_photos(dataset.views, model_folder);
    dataset.points = std::move(model.points);
    if (model.dropped_points > 0)
        dataset.notes.push_back(fmt::format("{} with NaN or infinity were dropped.",
                                            counted(model.dropped_points, "point")));
    if (dataset.points.size() == 0 && options.require_photos)
        dataset.notes.push_back("There are no sparse points; training starts from random ones.");
    if (has_masks && without_mask > 0)
        dataset.notes.push_back(fmt::format("{}: {} of {} photos have none.", masks.string(),
                                            without_mask, dataset.views.size()));
    const fs::path second = model_folder.parent_path() / "1";
    if (model_folder.filename() == "0" && is_colmap_model(second))
        dataset.notes.push_back(
            fmt::format("{} was read; {} and any further model are other pieces "
                        "of the reconstruction.",
                        model_folder.string(), second.string()));
    return dataset;
}

}  // namespace darb
