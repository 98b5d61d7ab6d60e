#include "viewer/path_export.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cmath>

#include "engine/core/error.h"
#include "engine/data/image_io.h"

namespace darb {

PathExport::PathExport(CameraPath path, std::filesystem::path folder, int fps)
    : path_(std::move(path)), folder_(std::move(folder)), fps_(fps), frames_(0) {
    if (path_.keys.empty())
        throw Error("camera path", "has no key frames", "Add some with the key K.");
    frames_ = static_cast<int>(std::floor(path_.duration() * fps_ + 1e-9)) + 1;
}

PathExport::~PathExport() {
    if (ffmpeg_ > 0) watch_video(true);
}

void PathExport::step(const std::function<ImageU8(const KeyFrame&)>& render) {
    if (done_) return;
    if (next_ < frames_) {
        write_png(folder_ / fmt::format("frame_{:05d}.png", next_),
                  render(path_.sample(double(next_) / fps_)));
        ++next_;
    } else if (ffmpeg_ < 0) {
        start_video();
    } else {
        watch_video(false);
    }
}

void PathExport::start_video() {
    summary_ = fmt::format("{} frames in {}", frames_, folder_.string());
    const std::string rate = std::to_string(fps_), in = (folder_ / "frame_%05d.png").string(),
                      out = (folder_ / "video.mp4").string();
    // yuv420p, which every player shows, needs even sizes.
    std::array<const char*, 17> arguments{
        "ffmpeg",     "-y",      "-loglevel", "error",   "-framerate",
        rate.c_str(), "-i",      in.c_str(),  "-vf",     "pad=ceil(iw/2)*2:ceil(ih/2)*2",
        "-c:v",       "libx264", "-pix_fmt",  "yuv420p", "-crf",
        "18",         nullptr};
    std::array<char*, 18> argv{};
    size_t n = 0;
    for (; arguments[n] != nullptr; ++n) argv[n] = const_cast<char*>(arguments[n]);
    argv[n] = const_cast<char*>(out.c_str());
    if (posix_spawnp(&ffmpeg_, "ffmpeg", nullptr, nullptr, argv.data(), environ) != 0) {
        ffmpeg_ = -1;
        done_ = true;
        summary_ += "; no video, ffmpeg is not installed";
    }
}

void PathExport::watch_video(bool wait) {
    int status = 0;
    if (waitpid(ffmpeg_, &status, wait ? 0 : WNOHANG) == 0) return;
    ffmpeg_ = -1;
    done_ = true;
    const bool made = WIFEXITED(status) && WEXITSTATUS(status) == 0;
    summary_ += made ? "; video " + (folder_ / "video.mp4").string()
                     : std::string("; no video: ffmpeg failed, its message is on the terminal");
}

}  // namespace darb
