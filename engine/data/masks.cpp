#include "engine/data/masks.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/core/error.h"
#include "engine/data/image_io.h"
#include "engine/data/source.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

bool holds_pictures(const fs::path& folder) {
    std::error_code none;  // no such folder: no entries
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

}  // namespace

std::string without_images(const std::string& name) {
    return name.starts_with(kImages) ? name.substr(kImages.size()) : name;
}

fs::path masks_folder(const fs::path& folder) {
    for (const char* name : {"masks", "mask"})
        if (holds_pictures(folder / name)) return folder / name;
    return {};
}

void add_masks(const fs::path& folder, const DatasetOptions& options, Dataset& dataset) {
    const fs::path masks = masks_folder(folder);
    if (masks.empty()) return;
    std::size_t without = 0;
    for (View& view : dataset.views) {
        view.mask = find_mask(masks, view.name);
        without += view.mask.empty() ? 1 : 0;
    }
    const std::size_t count = dataset.views.size();
    if (without == count && options.require_photos) {
        const std::string name = without_images(dataset.views[0].name);
        throw Error(masks.string(), fmt::format("holds the masks of none of the {} photos", count),
                    fmt::format("Name them as the photos, as {}.png for {}, or remove the folder.",
                                without_picture_extension(name).string(), name));
    }
    if (without > 0)
        dataset.notes.push_back(
            fmt::format("{}: {} of {} photos have none.", masks.string(), without, count));
}

}  // namespace darb
