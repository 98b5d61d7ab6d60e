#include "tools/darb/train_data.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/say.h"
#include "engine/core/text.h"
#include "engine/data/colmap.h"
#include "engine/data/masks.h"
#include "engine/data/run_colmap.h"
#include "engine/data/straight_masks.h"
#include "engine/data/video.h"
#include "tools/darb/photo_folder.h"
#include "tools/darb/video_photos.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

constexpr int kAnySize = 100'000;      // px: no limit
constexpr size_t kShownColumns = 100;  // of COLMAP's lines

void check_output(const fs::path& photos, const fs::path& output) {
    const fs::path inner = fs::weakly_canonical(output), outer = fs::weakly_canonical(photos);
    if (std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end()).first == outer.end())
        throw Error(output.string(), "lies among the photos, where COLMAP would take its pictures",
                    "Name an output folder outside of " + photos.string() + ".");
}

// Steps as lines of their own, and on a terminal what COLMAP says, in place.
void show(std::string_view line) {
    const bool step = line.starts_with('['), terminal = ::isatty(STDERR_FILENO) == 1;
    if (step) say_text(fmt::format("{}{}\n", terminal ? "\r\033[K" : "", printable(line)));
    if (!step && terminal)
        say_text(fmt::format("\r{}\033[K", printable(line.substr(0, kShownColumns))));
}

Dataset load_through_colmap(const fs::path& photos, const TrainFlags& flags,
                            std::optional<RunLock>& lock) {
    check_output(photos, flags.run.output);
    if (!lock) lock.emplace(flags.run.output);
    ColmapRun run;
    run.photos = fs::absolute(photos / "").lexically_normal().parent_path();
    run.masks = masks_folder(run.photos.parent_path());
    run.workspace = flags.run.output / "colmap";
    run.sequential = flags.sequential;
    if (flags.data.resolution != -1) run.max_image_size = kAnySize;
    const PhotoList list = list_photos(run.photos);
    std::string made_from = fmt::format("at most {} px\n{}", run.max_image_size, list.text);
    if (!run.masks.empty()) made_from += "masks " + run.masks.string() + "\n";
    run.single_camera = list.one_size;
    const fs::path list_file = run.workspace / "photos.txt", dense = run.workspace / "dense";
    if (fs::exists(list_file) && read_text_file(list_file) != made_from)
        throw Error(run.workspace.string(), "holds the cameras of other photos, or of another size",
                    "Remove it, or name another output folder.");
    if (!is_colmap_model(dense / "sparse")) {  // written last
        if (is_installed("colmap")) write_file_atomic(list_file, made_from);
        run_colmap(run, flags.run.quiet ? nullptr : show);
        if (!flags.run.quiet && ::isatty(STDERR_FILENO) == 1) say_text("\r\033[K");
    }
    const std::size_t masks = run.masks.empty() ? 0 : straighten_masks(run);
    DatasetOptions options = flags.data;
    options.images_folder = "images";
    Dataset dataset = load_dataset(dense, options);
    dataset.notes.insert(dataset.notes.begin(),
                         fmt::format("COLMAP found the cameras of {} of {} photos; {} is the data "
                                     "set with them.",
                                     dataset.views.size(), list.count, dense.string()));
    if (!list.left_out.empty()) dataset.notes.push_back(list.left_out);
    if (masks > 0)
        dataset.notes.push_back(
            fmt::format("The masks of {} photos were straightened with them and are in {}.", masks,
                        (dense / "masks").string()));
    return dataset;
}

bool needs_cameras(const TrainFlags& flags) {
    return (is_video_name(flags.dataset) && !fs::is_directory(flags.dataset)) ||
           !photos_without_cameras(flags.dataset, flags.data.images_folder).empty();
}

}  // namespace

void refuse_without_cameras(const TrainFlags& flags, int ranks) {
    if (ranks == 1 || !needs_cameras(flags)) return;
    throw Error(flags.dataset, "has no cameras yet, and several ranks do not look for them",
                "Run darb train on it once on one rank: -o OUT leaves OUT/colmap/dense, a data set "
                "with cameras.");
}

Dataset load_training_data(TrainFlags& flags, std::optional<RunLock>& lock) {
    const bool video = is_video_name(flags.dataset) && !fs::is_directory(flags.dataset);
    const fs::path photos = video ? photos_of_video(flags.dataset, flags, lock)
                                  : photos_without_cameras(flags.dataset, flags.data.images_folder);
    Dataset dataset = photos.empty() ? load_dataset(flags.dataset, flags.data)
                                     : load_through_colmap(photos, flags, lock);
    if (dataset.points.size() == 0) dataset.notes.push_back("There are no sparse points.");
    if (flags.train.random_points && dataset.points.size() > 0)
        dataset.notes.push_back(
            fmt::format("--random-points {} is for data sets without points; this one has {}.",
                        *flags.train.random_points, dataset.points.size()));
    if (flags.data.hold_out) return dataset;
    size_t own_test = 0;
    for (View& view : dataset.views) own_test += std::exchange(view.is_test, false) ? 1 : 0;
    if (own_test > 0)
        dataset.notes.push_back(fmt::format(
            "The data set's own test views, {}, are trained on; --eval holds them out.", own_test));
    return dataset;
}

}  // namespace darb
