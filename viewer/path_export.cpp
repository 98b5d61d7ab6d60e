#include "viewer/path_export.h"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <vector>

#include "engine/core/error.h"
#include "engine/data/image_io.h"
#include "engine/data/video.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

// Over nine hours at 30 frames a second; more is a mistake in the times.
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
    if (ffmpeg_ <= 0) return;
    ::kill(ffmpeg_, SIGTERM);
    int status = 0;
    wait_for_ffmpeg(status, true);
    folder_.drop_unfinished_video();
}

void PathExport::step(const Render& render, bool wait) {
    if (done_) return;
    if (!has_frames()) {
        Navigation view;
        apply(path_.sample(double(next_) / options_.fps), view);
        write_png(folder_.claim(frame_name(next_)),
                  render(view.camera(options_.width, options_.height), options_.display));
        ++next_;
    } else if (ffmpeg_ < 0) {
        folder_.finish(frames_);
        start_video();
    } else {
        watch_video(wait);
    }
}

void PathExport::start_video() {
    summary_ = fmt::format("{} frames in {}", frames_, folder_.path().string());
    const fs::path unfinished = folder_.claim(ExportFolder::kUnfinishedVideo);
    // yuv420p, which every player shows, needs even sizes.
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
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    if (posix_spawnp(&ffmpeg_, "ffmpeg", nullptr, nullptr, argv.data(), environ) != 0) {
        ffmpeg_ = -1;
        done_ = true;
        folder_.finish(frames_);
        summary_ += "; no video, ffmpeg is not installed";
    }
}

// Whether it has ended.
bool PathExport::wait_for_ffmpeg(int& status, bool wait) const {
    pid_t ended = -1;
    do ended = waitpid(ffmpeg_, &status, wait ? 0 : WNOHANG);
    while (ended < 0 && errno == EINTR);
    if (ended < 0) status = -1;
    return ended != 0;
}

void PathExport::watch_video(bool wait) {
    int status = 0;
    if (!wait_for_ffmpeg(status, wait)) return;
    ffmpeg_ = -1;
    done_ = true;
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) {
        folder_.keep_video();
        summary_ += "; video " + (folder_.path() / ExportFolder::kVideo).string();
    } else {
        folder_.drop_unfinished_video();
        summary_ += "; no video: ffmpeg failed, its message is on the terminal";
    }
    folder_.finish(frames_);
}

}  // namespace darb
