// PathExport: a camera path as numbered PNG frames, one frame a call so that a window stays alive,
// and then a video where ffmpeg is installed.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <string>

#include "engine/core/image.h"
#include "viewer/camera_path.h"
#include "viewer/display.h"

namespace darb {

struct ExportOptions {
    std::filesystem::path folder;
    int fps = 30;               // frames a second, 1 at least
    int width = 0, height = 0;  // px of every frame
    DisplaySettings display;    // of every frame; without a photo there is no error to show
};

class PathExport {
  public:
    /// The last key is shown, too. Throws Error for a path without keys and for less than one frame
    /// a second.
    PathExport(CameraPath path, const ExportOptions& options);
    ~PathExport();  // ends ffmpeg, and takes its unfinished video away
    PathExport(const PathExport&) = delete;
    PathExport& operator=(const PathExport&) = delete;

    int frame_count() const { return frames_; }
    int written() const { return next_; }
    double share() const { return double(next_) / (frames_ + 1); }
    bool done() const { return done_; }
    /// All frames are there; what is left is ffmpeg's.
    bool has_frames() const { return next_ >= frames_; }
    /// The next frame: `render` gives the picture of a camera. After the last, starts ffmpeg (and
    /// deletes frames with higher numbers, which an earlier export left), and then looks whether
    /// it has ended, or waits for that.
    using Render = std::function<ImageU8(const Camera&, const DisplaySettings&)>;
    void step(const Render& render, bool wait = false);
    /// What came out, for the user.
    const std::string& summary() const { return summary_; }

  private:
    std::filesystem::path frame_file(int n) const;
    std::filesystem::path video_file() const { return options_.folder / "video.mp4"; }
    void delete_later_frames() const;
    void start_video();
    void watch_video(bool wait);
    CameraPath path_;
    ExportOptions options_;
    int frames_, next_ = 0;
    pid_t ffmpeg_ = -1;
    bool done_ = false;
    std::string summary_;
};

}  // namespace darb
