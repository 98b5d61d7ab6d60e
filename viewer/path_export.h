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
#include "viewer/export_folder.h"

namespace darb {

struct ExportOptions {
    std::filesystem::path folder;
    int fps = 30;               // frames a second, 1 at least
    int width = 0, height = 0;  // px of every frame
    DisplaySettings display;    // of every frame; without a photo there is no error to show
};

class PathExport {
  public:
    /// The last key is shown, too. Throws Error for a path without keys or of more than a million
    /// frames, for less than one frame a second, and for a folder that holds files of these names
    /// that no export wrote.
    PathExport(CameraPath path, const ExportOptions& options);
    ~PathExport();  // ends ffmpeg, and deletes its unfinished video
    PathExport(const PathExport&) = delete;
    PathExport& operator=(const PathExport&) = delete;

    std::int64_t frame_count() const { return frames_; }
    std::int64_t written() const { return next_; }
    double share() const { return double(next_) / double(frames_ + 1); }
    bool done() const { return done_; }
    /// All frames are there; what is left is ffmpeg's.
    bool has_frames() const { return next_ >= frames_; }
    /// The next frame: `render` gives the picture of a camera. After the last, starts ffmpeg (and
    /// deletes frames with higher numbers that an earlier export wrote), and then looks whether
    /// it has ended, or waits for that.
    using Render = std::function<ImageU8(const Camera&, const DisplaySettings&)>;
    void step(const Render& render, bool wait = false);
    /// What came out, for the user.
    const std::string& summary() const { return summary_; }

  private:
    void start_video();
    void watch_video(bool wait);
    bool wait_for_ffmpeg(int& status, bool wait) const;
    CameraPath path_;
    ExportOptions options_;
    std::int64_t frames_, next_ = 0;
    ExportFolder folder_;
    pid_t ffmpeg_ = -1;
    bool done_ = false;
    std::string summary_;
};

}  // namespace darb
