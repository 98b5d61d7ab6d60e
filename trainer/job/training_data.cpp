// SPDX-License-Identifier: MIT
#include "trainer/job/training_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/process.h"
#include "engine/core/say.h"
#include "engine/core/system.h"
#include "engine/core/text.h"
#include "engine/data/colmap.h"
#include "engine/data/masks.h"
#include "engine/data/panorama_cameras.h"
#include "engine/data/panorama_files.h"
#include "engine/data/run_colmap.h"
#include "engine/data/video.h"
#include "trainer/job/photo_folder.h"
#include "trainer/options/presets.h"
#include "trainer/run/progress.h"
#include "trainer/run/run_folder.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

constexpr int kAnySize = 100'000;       // px: no limit
constexpr std::size_t kFewPhotos = 40;  // up to here preview compares all pairs, too
constexpr double kLineSeconds = 10;     // between two lines where there is no terminal

// Two of a phone's 30 pictures a second: enough to find the cameras, few enough for COLMAP to
// match.
constexpr std::size_t kEveryFrame = 15, kLeastFrames = 60, kMostFrames = 240;

// Both at once: a video needs both.
void need_programs(const fs::path& video) {
    std::string missing;
    for (const char* program : {"ffmpeg", "colmap"})
        if (!is_installed(program)) missing += (missing.empty() ? "" : " ") + std::string(program);
    if (missing.empty()) return;
    throw Error(video.string(),
                fmt::format("is a video: ffmpeg takes its pictures and colmap finds their cameras; "
                            "not installed: {}",
                            missing),
                fmt::format("apt install {}", missing));
}

// Which pictures lie in the folder, as frames.txt has it; it names no folder of the machine.
std::string key_of(const fs::path& video, const fs::path& output, int frames) {
    return fmt::format("{}\n{} bytes\n--frames {}\n", shared_name(output, video),
                       fs::file_size(video), frames);
}

constexpr std::string_view kUnfinished = "not all are written\n";

// Whether the pictures are there. Pictures that others put there are neither taken nor replaced.
bool has_pictures(const fs::path& folder, const fs::path& made, const std::string& key) {
    if (!fs::exists(made)) {
        if (fs::exists(folder) && !(fs::is_directory(folder) && fs::is_empty(folder)))
            throw Error(folder.string(), "is there, and not of this video",
                        "Name another output folder with -o.");
        return false;
    }
    const std::string text = read_text_file(made);
    if (text != key && text != key + std::string(kUnfinished))
        throw Error(folder.string(), "holds the pictures of another video, or another number",
                    "Name another output folder with -o.");
    return text == key;
}

// OUT/frames with the sharpest picture of each interval of the video, made where it is not there
// from the same video; request.sequential is set, as pictures that follow each other match best.
// Throws Error where ffmpeg or colmap is missing, before anything is written.
fs::path photos_of_video(const fs::path& video, TrainRequest& request, std::optional<RunLock>& lock,
                         const DataSinks& sinks) {
    request.sequential = true;
    const fs::path folder = request.output / "frames", made = request.output / "frames.txt";
    if (!fs::is_regular_file(video)) throw Error(video.string(), "is no file", "Check the path.");
    const std::string key = key_of(video, request.output, request.frames);
    if (has_pictures(folder, made, key)) return folder;
    need_programs(video);
    lock.emplace(request.output);
    if (!sinks.quiet) say("{}: looking for its sharpest pictures\n", video.string());
    if (sinks.said) sinks.said("looking for the sharpest pictures of the video");
    const std::vector<double> sharpness = video_sharpness(video);
    const std::size_t wanted =
        request.frames > 0 ? static_cast<std::size_t>(request.frames)
                           : std::clamp(sharpness.size() / kEveryFrame, kLeastFrames, kMostFrames);
    const std::vector<std::size_t> chosen = sharpest_of_intervals(sharpness, wanted);
    write_file_atomic(made, key + std::string(kUnfinished));  // a run that is ended here goes on
    write_video_frames(video, chosen, folder);
    write_file_atomic(made, key);
    if (!sinks.quiet)
        say("{}: {} of {} pictures, the sharpest of each interval, are in {}\n", video.string(),
            chosen.size(), sharpness.size(), folder.string());
    return folder;
}

void check_output(const fs::path& photos, const fs::path& output) {
    const fs::path inner = fs::weakly_canonical(output), outer = fs::weakly_canonical(photos);
    if (std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end()).first == outer.end())
        throw Error(output.string(), "lies among the photos, where COLMAP would take its pictures",
                    "Name an output folder outside of " + photos.string() + ".");
}

/// What COLMAP is at: a line in place on a terminal, else one now and then.
class ColmapScreen {
  public:
    explicit ColmapScreen(const DataSinks& sinks)
        : sinks_(&sinks), quiet_(sinks.quiet), terminal_(is_terminal(stderr)) {}
    ~ColmapScreen() { clear(); }
    ColmapScreen(const ColmapScreen&) = delete;
    ColmapScreen& operator=(const ColmapScreen&) = delete;
    void note(std::string_view text) {
        if (sinks_->said) sinks_->said(text);
        if (quiet_) return;
        clear();
        say_text(printable(text) + "\n");
    }
    void progress(std::size_t step, const ColmapOutput& output, double seconds, double left) {
        if (output.total() == 0) return;
        if (sinks_->said) sinks_->said(colmap_progress_text(step, output, seconds, left));
        if (quiet_) return;
        if (step != step_) told_ = 0;
        const bool ended = output.done() == output.total() && done_ != output.done();
        if (!terminal_ && seconds - told_ < kLineSeconds && !ended) return;
        told_ = seconds;
        step_ = step;
        done_ = output.done();
        say_text(fmt::format(fmt::runtime(terminal_ ? "\r{}\033[K" : "{}\n"),
                             colmap_progress_text(step, output, seconds, left)));
        shown_ = terminal_;
    }

  private:
    void clear() {
        if (shown_) say_text("\r\033[K");
        shown_ = false;
    }
    const DataSinks* sinks_;
    bool quiet_, terminal_, shown_ = false;
    std::size_t step_ = 0, done_ = 0;
    double told_ = 0;  // seconds of the step
};

std::string choose_few_features(ColmapRun& run) {
    run.effort = ColmapEffort::quick;
    return "--preset preview: COLMAP is asked for 2,048 features a photo in place of 8,192.";
}

// Neighbours where photos follow each other and are many; a sentence for people.
std::string choose_quick(const PhotoList& list, ColmapRun& run) {
    std::string fewer = choose_few_features(run);
    if (run.sequential) return fewer;
    fewer.pop_back();
    const std::size_t pairs = run.count * (run.count - 1) / 2;
    if (run.count <= kFewPhotos)
        return fmt::format("{}, and compares all {} pairs, as {} photos are few.", fewer, pairs,
                           run.count);
    run.quick_sequential = list.order != PhotoOrder::none;
    if (!run.quick_sequential)
        return fmt::format(
            "{}, and compares all {} pairs: neither the times at which the photos "
            "were taken nor numbers in their names say that they follow each "
            "other.",
            fewer, pairs);
    return fmt::format(
        "{}, and compares neighbours instead of all {} pairs, as the photos follow "
        "each other by {}.",
        fewer, pairs,
        list.order == PhotoOrder::times ? "the times at which they were taken"
                                        : "the numbers in their names");
}

// Those of the list that the model lacks.
std::string missing_photos(const PhotoList& list, const std::set<std::string>& found) {
    constexpr std::size_t kNamed = 12;
    std::string names;
    std::size_t missing = 0;
    for (const std::string& name : list.names)
        if (!found.contains(name) && missing++ < kNamed)
            names += (names.empty() ? "" : ", ") + name;
    if (missing == 0) return {};
    return fmt::format(" Not found were those of {}{}.", names, missing > kNamed ? ", ..." : "");
}

// Whether the photos are panoramas. `notes` gets a doubt.
bool are_panoramas(const PhotoList& list, const TrainRequest& request, const fs::path& photos,
                   std::vector<std::string>& notes) {
    if (request.panoramas != "auto") return request.panoramas == "on";
    const bool video = is_video_name(request.dataset) && !fs::is_directory(request.dataset);
    const std::size_t count = list.names.size();
    if (video && is_marked_panorama_video(request.dataset)) return true;
    if (list.marked_panoramas == count) return true;
    if (list.marked_panoramas > 0)
        throw Error(photos.string(),
                    fmt::format("{} of {} photos are panoramas, and COLMAP needs either kind alone",
                                list.marked_panoramas, count),
                    "Put them into two folders, or say --panoramas on or off.");
    if (list.twice_as_wide == count)
        notes.push_back(
            "Warning: the photos are twice as wide as high. If they show all directions, as those "
            "of a 360-degree camera do, remove the output folder and use --panoramas on.");
    return false;
}

// The first line is what dense was made with, the others are what the cameras were.
struct MadeFrom {
    std::string size, photos;
    static MadeFrom of(const ColmapRun& run, const PhotoList& list, bool panoramas) {
        MadeFrom made{size_line(run.max_image_size), list.text};
        if (!run.masks.empty()) made.photos += "masks " + run.masks.string() + "\n";
        if (panoramas) made.photos += "panoramas\n";
        return made;
    }
    static MadeFrom read(const fs::path& file) {
        const std::string text = read_text_file(file);
        const std::size_t end = std::min(text.find('\n'), text.size() - 1) + 1;
        return {text.substr(0, end), text.substr(end)};
    }
    static std::string size_line(int most) { return fmt::format("at most {} px\n", most); }
};

// Finds cameras, or takes those that are there; seconds: that it took.
fs::path make_dense(ColmapRun& run, const PhotoList& list, bool panoramas,
                    const TrainRequest& request, const DataSinks& sinks, double& seconds) {
    const fs::path list_file = run.workspace / "photos.txt", dense = run.workspace / "dense";
    const MadeFrom made = MadeFrom::of(run, list, panoramas);
    if (fs::exists(list_file)) {
        const MadeFrom there = MadeFrom::read(list_file);
        if (there.photos != made.photos)
            throw Error(run.workspace.string(), "holds the cameras of other photos",
                        "Remove it, or name another output folder.");
        const bool fits = there.size == made.size || there.size == MadeFrom::size_line(kAnySize);
        if (fits && is_colmap_model(dense / "sparse")) return dense;
    }
    if (is_installed("colmap")) write_file_atomic(list_file, made.size + made.photos);
    ColmapScreen screen(sinks);
    ColmapReports reports;
    reports.note = [&](std::string_view text) { screen.note(text); };
    reports.progress = [&](std::size_t step, const ColmapOutput& output, double spent,
                           double left) { screen.progress(step, output, spent, left); };
    if (is_installed("colmap") && largest_colmap_model(run.workspace / "sparse").empty()) {
        const std::string choice = request.preset != kRunPresets.front().name ? ""
                                   : panoramas ? choose_few_features(run)
                                               : choose_quick(list, run);
        if (!choice.empty()) screen.note(choice);
        screen.note(
            fmt::format("COLMAP looks for the cameras of {} photos first. The forecast of "
                        "the training follows.",
                        run.count));
    }
    run.stop = sinks.stop;
    const auto start = std::chrono::steady_clock::now();
    try {
        if (panoramas) {
            constexpr std::size_t kFewPanoramas = 12;
            run.sequential |= run.count > kFewPanoramas && list.order != PhotoOrder::none;
            find_panorama_cameras(run, list.names, reports);
        } else {
            run_colmap(run, reports);
        }
    } catch (const ColmapStopped&) {
        screen.note(fmt::format("COLMAP was stopped. The same command goes on from what is in {}.",
                                run.workspace.string()));
        throw;
    }
    seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return dense;
}

Dataset load_through_colmap(const fs::path& photos, const TrainRequest& request,
                            std::optional<RunLock>& lock, const DataSinks& sinks) {
    check_output(photos, request.output);
    if (!lock) lock.emplace(request.output);
    ColmapRun run;
    run.photos = fs::absolute(photos / "").lexically_normal().parent_path();
    run.masks = masks_folder(run.photos.parent_path());
    run.workspace = request.output / "colmap";
    run.sequential = request.sequential;
    if (request.data.resolution != -1) run.max_image_size = kAnySize;
    const PhotoList list = list_photos(run.photos);
    run.single_camera = list.one_size;
    run.count = list.names.size();
    double seconds = 0;
    std::vector<std::string> doubts;
    const bool panoramas = are_panoramas(list, request, photos, doubts);
    const fs::path dense = make_dense(run, list, panoramas, request, sinks, seconds);
    const std::size_t masks = run.masks.empty() || panoramas ? 0 : straighten_masks(run);
    DatasetOptions options = request.data;
    options.images_folder = "images";
    Dataset dataset = load_dataset(dense, options);
    std::set<std::string> placed;
    for (const View& view : dataset.views)
        placed.insert(fs::relative(view.photo, dense / "images").generic_string());
    std::string found =
        fmt::format("COLMAP found the cameras of {} of {} {}; {} is the data set with them.{}",
                    placed.size(), run.count, panoramas ? "panoramas" : "photos", dense.string(),
                    missing_photos(list, placed));
    const bool preview = request.preset == kRunPresets.front().name;
    if (effort_of_colmap(run.workspace) == ColmapEffort::quick && !preview)
        found += fmt::format(
            " They are those of a run with --preset preview, found with fewer "
            "features; remove {} to look for them anew.",
            run.workspace.string());
    if (seconds > 0)
        found += fmt::format(
            " That took {}, which the forecast leaves out; other presets with "
            "this output folder use them again.",
            format_duration(seconds));
    dataset.notes.insert(dataset.notes.begin(), std::move(found));
    dataset.notes.insert(dataset.notes.end(), doubts.begin(), doubts.end());
    if (!list.left_out.empty()) dataset.notes.push_back(list.left_out);
    if (masks > 0)
        dataset.notes.push_back(
            fmt::format("The masks of {} photos were straightened with them and are in {}.", masks,
                        (dense / "masks").string()));
    return dataset;
}

bool needs_cameras(const TrainRequest& request) {
    return (is_video_name(request.dataset) && !fs::is_directory(request.dataset)) ||
           !photos_without_cameras(request.dataset, request.data.images_folder).empty();
}

}  // namespace

std::string colmap_progress_text(std::size_t step, const ColmapOutput& output, double seconds,
                                 double left) {
    constexpr std::array kNames{"looking for features", "matching", "placing cameras",
                                "straightening"};
    std::string text =
        fmt::format("[{}/{}] {}: {} of {} {}", step, kColmapSteps, kNames.at(step - 1),
                    output.done(), output.total(), output.unit());
    if (output.model() > 1) text += fmt::format(" in model {}", output.model());
    text += ", " + format_duration(seconds);
    if (left >= 0 && output.done() < output.total())
        text += fmt::format(", about {} left", format_duration(left));
    return text;
}

void refuse_without_cameras(const TrainRequest& request, int ranks) {
    if (ranks == 1 || !needs_cameras(request)) return;
    throw Error(request.dataset, "has no cameras yet, and several ranks do not look for them",
                "Run darb train on it once on one rank: -o OUT leaves OUT/colmap/dense, a data set "
                "with cameras.");
}

Dataset load_training_data(TrainRequest& request, std::optional<RunLock>& lock,
                           const DataSinks& sinks) {
    complete_request(request);
    require_places(request);
    const bool video = is_video_name(request.dataset) && !fs::is_directory(request.dataset);
    const fs::path photos =
        video ? photos_of_video(request.dataset, request, lock, sinks)
              : photos_without_cameras(request.dataset, request.data.images_folder);
    Dataset dataset = photos.empty() ? load_dataset(request.dataset, request.data)
                                     : load_through_colmap(photos, request, lock, sinks);
    if (photos.empty() && request.panoramas != "auto")
        dataset.notes.push_back(
            fmt::format("--panoramas {} changes nothing: the data set has cameras, which say what "
                        "its photos show.",
                        request.panoramas));
    if (!request.points.empty()) replace_points(request.points, dataset);
    if (dataset.points.size() == 0) dataset.notes.push_back("There are no sparse points.");
    if (request.train.random_points && dataset.points.size() > 0)
        dataset.notes.push_back(
            fmt::format("--random-points {} is for data sets without points; this one has {}.",
                        *request.train.random_points, dataset.points.size()));
    if (request.data.hold_out) return dataset;
    size_t own_test = 0;
    for (View& view : dataset.views) own_test += std::exchange(view.is_test, false) ? 1 : 0;
    if (own_test > 0)
        dataset.notes.push_back(fmt::format(
            "The data set's own test views, {}, are trained on; --eval holds them out.", own_test));
    return dataset;
}

}  // namespace darb
