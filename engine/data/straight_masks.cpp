#include "engine/data/straight_masks.h"

#include <algorithm>
#include <map>

#include "engine/core/error.h"
#include "engine/data/colmap.h"
#include "engine/data/image_io.h"
#include "engine/data/lens_model.h"
#include "engine/data/masks.h"
#include "engine/data/resample.h"
#include "engine/data/source.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

/// The photos that have masks as colmap was given them, with their lenses, at their own size.
Dataset masked_photos(const ColmapRun& run) {
    const fs::path sparse = run.workspace / "sparse";
    const ColmapModel model = read_colmap(sparse / largest_colmap_model(sparse));
    Dataset dataset;
    for (const ColmapImage& image : model.images) {
        View view;
        view.name = image.name;
        view.photo = run.photos / image.name;
        view.lens = model.cameras.at(image.camera_id);
        dataset.views.push_back(std::move(view));
    }
    DatasetOptions whole;
    whole.resolution = 1;
    whole.original_lens = true;
    add_masks(run.photos.parent_path(), whole, dataset);
    std::erase_if(dataset.views, [](const View& view) { return view.mask.empty(); });
    fit_views(dataset, whole);
    return dataset;
}

ImageU8 straight_mask(const View& view, const Camera& pinhole) {
    const ImageU8 rgba = undistort(load_photo(view), view.lens, pinhole);
    ImageU8 mask(rgba.width, rgba.height, 1);
    for (std::size_t p = 0; p < mask.data.size(); ++p) mask.data[p] = rgba.data[p * 4 + 3];
    return mask;
}

}  // namespace

std::size_t straighten_masks(const ColmapRun& run) {
    const fs::path dense = run.workspace / "dense", made = dense / "masks",
                   unfinished = dense / "masks.unfinished";
    const ColmapModel straight = read_colmap(dense / "sparse");
    std::map<std::string, Camera> pinholes;
    for (const ColmapImage& image : straight.images)
        pinholes[image.name] = pinhole_camera(straight.cameras.at(image.camera_id));
    const bool there = fs::exists(made);
    std::size_t count = 0;
    for (const View& view : masked_photos(run).views) {
        const auto pinhole = pinholes.find(view.name);
        if (pinhole == pinholes.end()) continue;
        ++count;
        if (!there)
            write_png(unfinished / (view.name + ".png"), straight_mask(view, pinhole->second));
    }
    if (there || count == 0) return count;
    std::error_code failure;
    fs::rename(unfinished, made, failure);
    if (failure)
        throw Error(made.string(), "cannot be made: " + failure.message(),
                    "Make room, or name another output folder.");
    return count;
}

}  // namespace darb
