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

namespace darb {

namespace fs = std::filesystem;

namespace {

// frame_00012.png is 12; -1 for other names.
int frame_number(const std::string& name) {
    int number = -1, end = 0;
    if (std::sscanf(name.c_str(), "frame_%9d.png%n", &number, &end) != 1) return -1;
    const bool ours = name == fmt::format("frame_{:05d}.png", number);
    return ours && number >= 0 ? number : -1;
}

// ffmpeg reads %05d in the name of its input: a percent sign of the folder is written twice.
std::string as_pattern(const fs::path& folder) {
    std::string pattern;
    for (const char c : folder.string()) pattern += c == '%' ? "%%" : std::string(1, c);
    return pattern;
}

}  // namespace

PathExport::PathExport(CameraPath path, const ExportOptions& options)
    : path_(std::move(path)), options_(options), frames_(0) {
    if (path_.keys.empty())
        throw Error("camera path", "has no key frames", "Add some with the key K.");
    if (options_.fps < 1)
        throw Error("camera path", fmt::format("{} frames a second", options_.fps),
                    "Export at least one frame a second.");
    if (options_.display.mode == VIEW_ERROR) options_.display.mode = VIEW_COLOUR;
    frames_ = static_cast<int>(std::floor(path_.duration() * options_.fps + 1e-9)) + 1;
}

PathExport::~PathExport() {
    if (ffmpeg_ <= 0) return;
    ::kill(ffmpeg_, SIGTERM);
    watch_video(true);
    std::error_code none;
    fs::remove(video_file(), none);
}

fs::path PathExport::frame_file(int n) const {
    return options_.folder / fmt::format("frame_{:05d}.png", n);
}

void PathExport::step(const Render& render, bool wait) {
    if (done_) return;
    if (!has_frames()) {
        Navigation view;
        apply(path_.sample(double(next_) / options_.fps), view);
        write_png(frame_file(next_),
                  render(view.camera(options_.width, options_.height), options_.display));
        ++next_;
    } else if (ffmpeg_ < 0) {
        delete_later_frames();
        start_video();
    } else {
        watch_video(wait);
    }
}

void PathExport::delete_later_frames() const {
    std::error_code none;
    std::vector<fs::path> later;
    for (const fs::directory_entry& entry : fs::directory_iterator(options_.folder, none))
        if (frame_number(entry.path().filename().string()) >= frames_) later.push_back(entry);
    for (const fs::path& file : later) fs::remove(file, none);
}

void PathExport::start_video() {
    summary_ = fmt::format("{} frames in {}", frames_, options_.folder.string());
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
                                   as_pattern(options_.folder) + "/frame_%05d.png",
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
                                   video_file().string()};
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    if (posix_spawnp(&ffmpeg_, "ffmpeg", nullptr, nullptr, argv.data(), environ) != 0) {
        ffmpeg_ = -1;
        done_ = true;
        summary_ += "; no video, ffmpeg is not installed";
    }
}

void PathExport::watch_video(bool wait) {
    int status = 0;
    pid_t ended = -1;
    do ended = waitpid(ffmpeg_, &status, wait ? 0 : WNOHANG);
    while (ended < 0 && errno == EINTR);
    if (ended == 0) return;
    const bool made = ended == ffmpeg_ && WIFEXITED(status) && WEXITSTATUS(status) == 0;
    ffmpeg_ = -1;
    done_ = true;
    summary_ += made ? "; video " + video_file().string()
                     : std::string("; no video: ffmpeg failed, its message is on the terminal");
}

}  // namespace darb
