#include "tools/darb/train_data.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/data/colmap.h"
#include "engine/data/image_io.h"
#include "engine/data/run_colmap.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

constexpr int kAnySize = 100'000;  // px: no limit
constexpr size_t kMinPhotos = 3;
constexpr size_t kShownColumns = 100;  // of COLMAP's lines

bool is_photo(const fs::path& path) {
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return extension == ".png" || extension == ".jpg" || extension == ".jpeg";
}

bool has_cameras(const fs::path& folder) {
    if (fs::exists(folder / "sparse") || fs::exists(folder / "colmap" / "sparse") ||
        is_colmap_model(folder))
        return true;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
        const std::string name = entry.path().filename().string();
        if (name.starts_with("transforms") && name.ends_with(".json")) return true;
    }
    return false;
}

// The folder of the photos, where path has photos and no cameras; else empty.
fs::path photos_without_cameras(const fs::path& path, const std::string& images_folder) {
    if (!fs::is_directory(path) || has_cameras(path)) return {};
    for (const fs::path& folder : {path / images_folder, path}) {
        std::error_code none;  // no such folder: no entries
        for (const fs::directory_entry& entry : fs::directory_iterator(folder, none))
            if (is_photo(entry.path())) return folder;
    }
    return {};
}

struct PhotoList {
    std::string text;  // a line a photo: tells whether OUT/colmap was made from the same ones
    size_t count = 0;
    bool one_size = true;
};

PhotoList list_photos(const fs::path& folder, int max_image_size) {
    std::vector<std::string> lines;
    std::set<std::pair<int, int>> sizes;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
        if (!is_photo(entry.path())) continue;
        const ImageInfo info = read_image_info(entry.path());
        sizes.insert({info.width, info.height});
        lines.push_back(fmt::format("{} bytes {}\n", entry.file_size(),
                                    fs::relative(entry.path(), folder).string()));
    }
    if (lines.size() < kMinPhotos)
        throw Error(
            folder.string(),
            fmt::format("has no cameras, and {} photos are too few to find them", lines.size()),
            "Take 20 or more photos around the scene, each overlapping the next by 60 %.");
    std::sort(lines.begin(), lines.end());
    PhotoList list{fmt::format("at most {} px\n", max_image_size), lines.size(), sizes.size() == 1};
    for (const std::string& line : lines) list.text += line;
    return list;
}

void check_output(const fs::path& photos, const fs::path& output) {
    const fs::path inner = fs::weakly_canonical(output), outer = fs::weakly_canonical(photos);
    if (std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end()).first == outer.end())
        throw Error(output.string(), "lies among the photos, where COLMAP would take its pictures",
                    "Name an output folder outside of " + photos.string() + ".");
}

// Steps as lines of their own, and on a terminal what COLMAP says, in place.
void show(std::string_view line) {
    const bool step = line.starts_with('['), terminal = ::isatty(STDERR_FILENO) == 1;
    if (step) fmt::print(stderr, "{}{}\n", terminal ? "\r\033[K" : "", line);
    if (!step && terminal) fmt::print(stderr, "\r{}\033[K", line.substr(0, kShownColumns));
}

Dataset load_through_colmap(const fs::path& photos, const TrainFlags& flags) {
    check_output(photos, flags.run.output);
    ColmapRun run;
    run.photos = photos;
    run.workspace = flags.run.output / "colmap";
    run.sequential = flags.sequential;
    if (flags.data.resolution != -1) run.max_image_size = kAnySize;
    const PhotoList list = list_photos(photos, run.max_image_size);
    run.single_camera = list.one_size;
    const fs::path list_file = run.workspace / "photos.txt", dense = run.workspace / "dense";
    if (fs::exists(list_file) && read_text_file(list_file) != list.text)
        throw Error(run.workspace.string(), "holds the cameras of other photos, or of another size",
                    "Remove it, or name another output folder.");
    if (!is_colmap_model(dense / "sparse")) {  // written last
        if (is_installed("colmap")) write_file_atomic(list_file, list.text);
        run_colmap(run, flags.run.quiet ? nullptr : show);
        if (!flags.run.quiet && ::isatty(STDERR_FILENO) == 1) fmt::print(stderr, "\r\033[K");
    }
    DatasetOptions options = flags.data;
    options.images_folder = "images";
    Dataset dataset = load_dataset(dense, options);
    dataset.notes.insert(dataset.notes.begin(),
                         fmt::format("COLMAP found the cameras of {} of {} photos; {} is the data "
                                     "set with them.",
                                     dataset.views.size(), list.count, dense.string()));
    return dataset;
}

}  // namespace

Dataset load_training_data(const TrainFlags& flags) {
    const fs::path photos = photos_without_cameras(flags.dataset, flags.data.images_folder);
    Dataset dataset = photos.empty() ? load_dataset(flags.dataset, flags.data)
                                     : load_through_colmap(photos, flags);
    if (flags.data.hold_out) return dataset;
    size_t own_test = 0;
    for (View& view : dataset.views) own_test += std::exchange(view.is_test, false) ? 1 : 0;
    if (own_test > 0)
        dataset.notes.push_back(fmt::format(
            "The data set's own test views, {}, are trained on; --eval holds them out.", own_test));
    return dataset;
}

}  // namespace darb
