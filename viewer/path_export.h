// PathExport: a camera path as numbered PNG frames, one frame a call so that a window stays alive,
// and then a video where ffmpeg is installed.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <string>

#include "engine/core/image.h"
#include "viewer/camera_path.h"

namespace darb {

class PathExport {
  public:
    /// fps frames a second, the last key included. Throws Error for a path without keys.
    PathExport(CameraPath path, std::filesystem::path folder, int fps);
    ~PathExport();  // waits for ffmpeg
    PathExport(const PathExport&) = delete;
    PathExport& operator=(const PathExport&) = delete;

    int frame_count() const { return frames_; }
    double share() const { return double(next_) / (frames_ + 1); }
    bool done() const { return done_; }
    /// The next frame: `render` gives the picture at a key. After the last, starts ffmpeg, and then
    /// looks whether it has ended.
    void step(const std::function<ImageU8(const KeyFrame&)>& render);
    /// What came out, for the user.
    const std::string& summary() const { return summary_; }

  private:
    void start_video();
    void watch_video(bool wait);
    CameraPath path_;
    std::filesystem::path folder_;
    int fps_, frames_, next_ = 0;
    pid_t ffmpeg_ = -1;
    bool done_ = false;
    std::string summary_;
};

}  // namespace darb
