// SPDX-License-Identifier: MIT
#include "viewer/path_export.h"

#include <fmt/format.h>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/process.h"
#include "engine/core/system_files.h"
#include "engine/data/image_io.h"
#include "engine/data/panorama_files.h"
#include "engine/data/video.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kFirstLine =
    "Written by darb view --export, which replaces and deletes these files alone:\n";

// Links are not followed, because their targets are not in this folder.
bool is_plain_file(const fs::path& path) {
    std::error_code none;
    return fs::symlink_status(path, none).type() == fs::file_type::regular;
}

bool is_missing(const fs::path& path) {
    std::error_code none;
    return fs::symlink_status(path, none).type() == fs::file_type::not_found;
}

bool can_be_listed(const std::string& name) {
    return frame_number(name) >= 0 || name == ExportFolder::kVideo ||
           name == ExportFolder::kUnfinishedVideo;
}

}  // namespace

std::string frame_name(std::int64_t n) {
    return fmt::format("frame_{:05d}.png", n);
}

std::int64_t frame_number(const std::string& name) {
    constexpr std::string_view kStart = "frame_", kEnd = ".png";
    if (name.size() <= kStart.size() + kEnd.size()) return -1;
    std::int64_t number = -1;
    const char* const digits = name.data() + kStart.size();
    const char* const end = name.data() + name.size() - kEnd.size();
    if (std::from_chars(digits, end, number).ptr != end || number < 0) return -1;
    return name == frame_name(number) ? number : -1;
}

ExportFolder::ExportFolder(fs::path folder, std::int64_t frames) : folder_(std::move(folder)) {
    read_list();
    std::error_code none;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_, none)) {
        const std::string name = entry.path().filename().string();
        const std::int64_t n = frame_number(name);
        if ((n >= 0 && n < frames) || name == kVideo || name == kUnfinishedVideo) check_free(name);
    }
    if (is_missing(folder_ / kList)) write_list();
}

// Returns whether there is a list.
bool ExportFolder::check_list() const {
    const fs::path file = folder_ / kList;
    if (is_missing(file)) return false;
    if (!is_plain_file(file) || !read_text_file(file).starts_with(kFirstLine))
        throw Error(file.string(), "is not the list of an export's files",
                    "Choose another folder, or move it away.");
    return true;
}

void ExportFolder::read_list() {
    if (!check_list()) return;
    std::istringstream text(read_text_file(folder_ / kList));
    std::string line;
    while (std::getline(text, line))
        if (can_be_listed(line)) listed_.insert(line);
}

bool ExportFolder::is_ours(const std::string& name) const {
    return listed_.contains(name) && is_plain_file(folder_ / name);
}

void ExportFolder::check_free(const std::string& name) const {
    const fs::path file = folder_ / name;
    if (is_missing(file) || is_ours(name)) return;
    throw Error(file.string(),
                is_plain_file(file) ? fmt::format("exists, and {} does not say that an export "
                                                  "wrote it",
                                                  kList)
                                    : "exists, and is not a file that an export wrote",
                "Choose another folder, or move it away: an export replaces only its own files.");
}

fs::path ExportFolder::claim(const std::string& name) {
    check_free(name);
    const fs::path list = folder_ / kList;
    if (listed_.contains(name)) return folder_ / name;
    // Each frame appends a line, so that the list is complete even when the export is killed.
    File file(list, File::Open::append_own);
    const std::string line = name + '\n';
    if (!file.is_open() || !file.write(std::as_bytes(std::span(line))))
        throw Error(list.string(), "cannot be written: " + file.error().message(),
                    "Free space or choose another folder.");
    listed_.insert(name);
    return folder_ / name;
}

void ExportFolder::keep_video() {
    const fs::path video = claim(kVideo);
    fs::rename(folder_ / kUnfinishedVideo, video);
}

void ExportFolder::drop_unfinished_video() const {
    std::error_code none;
    if (is_ours(kUnfinishedVideo)) fs::remove(folder_ / kUnfinishedVideo, none);
}

void ExportFolder::finish(std::int64_t frames) {
    check_list();
    std::error_code none;
    for (const std::string& name : listed_)
        if (frame_number(name) >= frames && is_ours(name)) fs::remove(folder_ / name, none);
    std::erase_if(listed_, [&](const std::string& name) { return is_missing(folder_ / name); });
    write_list();
}

void ExportFolder::write_list() const {
    std::string text(kFirstLine);
    for (const std::string& name : listed_) text += name + '\n';
    write_file_atomic(folder_ / kList, text);
}

namespace fs = std::filesystem;

namespace {

// This is over nine hours at 30 frames a second; more is a mistake in the times.
constexpr double kMostFrames = 1'000'000;

std::int64_t count_frames(const CameraPath& path, int fps) {
    const std::string where = path.file.empty() ? "camera path" : path.file.string();
    if (path.keys.empty()) throw Error(where, "has no key frames", "Add some with the key K.");
    if (fps < 1)
        throw Error(where, fmt::format("{} frames a second", fps),
                    "Export at least one frame a second.");
    const double frames = std::floor(path.duration() * fps + 1e-9) + 1;
    if (!(frames >= 1 && frames <= kMostFrames))
        throw Error(fmt::format("{}, key {}", where, path.keys.size() - 1),
                    fmt::format("{} s at {} frames a second are {:.0f} frames; an export writes 1 "
                                "to {:.0f}",
                                path.duration(), fps, frames, kMostFrames),
                    "Set the keys' seconds, which count from the start, or lower the frames a "
                    "second.");
    return static_cast<std::int64_t>(frames);
}

}  // namespace

PathExport::PathExport(CameraPath path, const ExportOptions& options)
    : path_(std::move(path)),
      options_(options),
      frames_(count_frames(path_, options.fps)),
      folder_(options.folder, frames_) {
    if (options_.display.mode == VIEW_ERROR) options_.display.mode = VIEW_COLOUR;
}

PathExport::~PathExport() {
    if (!ffmpeg_) return;
    ffmpeg_.reset();
    folder_.drop_unfinished_video();
}

ImageU8 PathExport::frame(const Render& render) const {
    return blurred(options_.blur, [&](int i) {
        Navigation view;
        apply(path_.sample(double(next_) / options_.fps + shutter_time(options_.blur, i)), view);
        const Camera camera = view.camera(options_.width, options_.height);
        return render(through_lens(camera, options_.blur, i), options_.display);
    });
}

void PathExport::step(const Render& render, bool wait) {
    if (done_) return;
    if (!has_frames()) {
        const auto write = options_.panorama ? write_panorama_png : write_png;
        write(folder_.claim(frame_name(next_)), frame(render));
        ++next_;
    } else if (!ffmpeg_) {
        folder_.finish(frames_);
        start_video();
    } else {
        watch_video(wait);
    }
}

void PathExport::start_video() {
    summary_ = fmt::format("{} frames in {}", frames_, folder_.path().string());
    const fs::path unfinished = folder_.claim(ExportFolder::kUnfinishedVideo);
    // yuv420p, which every player can show, needs even sizes.
    std::vector<std::string> words{"ffmpeg",
                                   "-nostdin",
                                   "-y",
                                   "-loglevel",
                                   "error",
                                   "-framerate",
                                   std::to_string(options_.fps),
                                   "-start_number",
                                   "0",
                                   "-i",
                                   picture_pattern(folder_.path(), "frame_%05d.png"),
                                   "-frames:v",
                                   std::to_string(frames_),
                                   "-vf",
                                   "pad=ceil(iw/2)*2:ceil(ih/2)*2",
                                   "-c:v",
                                   "libx264",
                                   "-pix_fmt",
                                   "yuv420p",
                                   "-crf",
                                   "18",
                                   "-f",
                                   "mp4",
                                   fs::absolute(unfinished).string()};
    if (is_installed("ffmpeg")) {
        ffmpeg_ = std::make_unique<ChildProcess>(words);
    } else {
        done_ = true;
        folder_.finish(frames_);
        summary_ += "; no video, ffmpeg is not installed";
    }
}

void PathExport::watch_video(bool wait) {
    const std::optional<ProcessEnd> ended = wait ? ffmpeg_->wait() : ffmpeg_->look();
    if (!ended) return;
    ffmpeg_.reset();
    done_ = true;
    if (ended->is_good()) {
        if (options_.panorama) mark_panorama_video(folder_.path() / ExportFolder::kUnfinishedVideo);
        folder_.keep_video();
        summary_ += "; video " + (folder_.path() / ExportFolder::kVideo).string();
    } else {
        folder_.drop_unfinished_video();
        summary_ += "; no video: ffmpeg failed, its message is on the terminal";
    }
    folder_.finish(frames_);
}

}  // namespace darb
