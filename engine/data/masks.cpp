// SPDX-License-Identifier: MIT
#include "engine/data/masks.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>

#include "engine/core/error.h"
#include "engine/data/colmap.h"
#include "engine/data/image_io.h"
#include "engine/data/lens_model.h"
#include "engine/data/source.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

bool holds_pictures(const fs::path& folder) {
    std::error_code none;  // a missing folder has no entries
    return std::any_of(
        fs::recursive_directory_iterator(folder, none), {}, [](const fs::directory_entry& entry) {
            return is_photo_name(entry.path()) || is_foreign_picture_name(entry.path());
        });
}

fs::path find_mask(const fs::path& masks, const std::string& name) {
    for (const fs::path& photo : {fs::path(name), fs::path(without_images(name))})
        for (const fs::path& stem : {photo, without_picture_extension(photo)})
            for (const char* tail : {".png", ".mask.png"})
                if (fs::path found = find_photo(masks, stem.string() + tail); !found.empty())
                    return found;
    return {};
}

/// A file's name in lower case, without picture extensions and "mask".
std::string bare_name(const fs::path& path) {
    std::string name = lower_case(path.filename().string());
    for (bool more = true; more;) {
        const std::size_t before = name.size();
        name = without_picture_extension(name).string();
        for (const std::string_view tail : {".mask", "_mask", "-mask", " mask"})
            if (name.size() > tail.size() && name.ends_with(tail))
                name.erase(name.size() - tail.size());
        for (const std::string_view head : {"mask_", "mask-"})
            if (name.size() > head.size() && name.starts_with(head)) name.erase(0, head.size());
        more = name.size() < before;
    }
    return name;
}

/// Whether the folders of two names agree; either may lack folders that the other has.
bool folders_agree(const fs::path& a, const fs::path& b) {
    const std::string one = lower_case(a.parent_path().generic_string()),
                      two = lower_case(b.parent_path().generic_string());
    return one.empty() || two.empty() || one == two || one.ends_with("/" + two) ||
           two.ends_with("/" + one);
}

/// Finds masks for views without one by their bare names, where these are unambiguous.
void find_masks_by_bare_name(const fs::path& masks, Dataset& dataset) {
    std::multimap<std::string, fs::path> files;
    std::error_code none;
    for (const auto& entry : fs::recursive_directory_iterator(masks, none))
        if (is_photo_name(entry.path()) || is_foreign_picture_name(entry.path()))
            files.emplace(bare_name(entry.path()), entry.path().lexically_relative(masks));
    std::map<std::string, std::size_t> photos;
    for (const View& view : dataset.views) ++photos[bare_name(view.name)];
    for (View& view : dataset.views) {
        const std::string name = bare_name(view.name);
        const auto [first, end] = files.equal_range(name);
        if (!view.mask.empty() || photos[name] != 1 || first == end || std::next(first) != end)
            continue;
        if (folders_agree(without_images(view.name), first->second))
            view.mask = masks / first->second;
    }
}

/// Takes NAME_mask.png and the like beside the photos. Returns how many it found.
std::size_t find_masks_beside_photos(Dataset& dataset) {
    std::size_t found = 0;
    for (View& view : dataset.views) {
        const fs::path stem = without_picture_extension(view.photo);
        for (const std::string& name : {stem.string(), view.photo.string()})
            for (const char* tail : {"_mask.png", ".mask.png", "-mask.png"})
                if (view.mask.empty() && !name.empty()) view.mask = find_photo("", name + tail);
        found += view.mask.empty() ? 0 : 1;
    }
    return found;
}

}  // namespace

std::string without_images(const std::string& name) {
    return name.starts_with(kImages) ? name.substr(kImages.size()) : name;
}

fs::path masks_folder(const fs::path& folder) {
    for (const char* name : {"masks", "mask"})
        if (holds_pictures(folder / name)) return folder / name;
    for (const fs::path& other : folders_of(folder)) {
        const std::string name = lower_case(other.filename().string());
        if ((name == "masks" || name == "mask") && holds_pictures(other)) return other;
    }
    return {};
}

void add_masks(const fs::path& folder, const DatasetOptions& options, Dataset& dataset) {
    const fs::path masks = masks_folder(folder);
    const std::size_t count = dataset.views.size();
    if (masks.empty()) {
        const std::size_t beside = find_masks_beside_photos(dataset);
        if (beside > 0)
            dataset.notes.push_back(
                fmt::format("Masks were found beside the photos: {} of {} photos have none.",
                            count - beside, count));
        else if (const std::string unused = unused_folders({folder}, {"mask", "segment"});
                 !unused.empty() && options.require_photos)
            dataset.notes.push_back(fmt::format(
                "Warning: not used: {}. If these are masks, black where pixels are to be left out, "
                "name their folder masks and the files as the photos.",
                unused));
        return;
    }
    std::size_t without = 0;
    for (View& view : dataset.views) view.mask = find_mask(masks, view.name);
    find_masks_by_bare_name(masks, dataset);
    for (const View& view : dataset.views) without += view.mask.empty() ? 1 : 0;
    if (without == count && options.require_photos) {
        const std::string name = without_images(dataset.views[0].name);
        throw Error(
            masks.string(), fmt::format("holds no mask for any of the {} photos", count),
            fmt::format(
                "Name masks like their photos, such as {}.png for {}, or remove the folder.",
                without_picture_extension(name).string(), name));
    }
    if (without > 0)
        dataset.notes.push_back(
            fmt::format("{}: {} of {} photos have none.", masks.string(), without, count));
}

namespace fs = std::filesystem;

namespace {

/// The photos whose masks were given to COLMAP, with their lenses, at full size.
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
