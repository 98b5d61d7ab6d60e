// SPDX-License-Identifier: MIT
// PathExport: writes a camera path as numbered PNG frames, one frame a call so that a window stays
// alive, and then as a video where ffmpeg is installed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <set>
#include <string>

#include "engine/core/image.h"
#include "engine/core/process.h"
#include "engine/render/camera_blur.h"
#include "viewer/camera_path.h"
#include "viewer/display.h"

namespace darb {

/// frame_00012.png.
std::string frame_name(std::int64_t n);
/// 12 of frame_00012.png; -1 for every name that frame_name does not make.
std::int64_t frame_number(const std::string& name);

class ExportFolder {
  public:
    static constexpr const char* kList = "darb_export.txt";
    static constexpr const char* kVideo = "video.mp4";
    static constexpr const char* kUnfinishedVideo = "video.mp4.tmp";

    /// Reads the list of an earlier export, where there is one, and makes the folder where it is
    /// missing. Throws Error where a file with the list's name is something else, and where a name
    /// that an export of so many frames writes is taken: the file is not on the list, or it is a
    /// link or a folder.
    ExportFolder(std::filesystem::path folder, std::int64_t frames);

    /// Puts a name on the list before it is written. Throws Error where the name is taken by a file
    /// that no export wrote, or where the list cannot be written.
    std::filesystem::path claim(const std::string& name);
    /// Gives the finished video its name.
    void keep_video();
    void drop_unfinished_video() const;
    /// Deletes the frames of an earlier export from number `frames` on, and takes names that are no
    /// longer there from the list.
    void finish(std::int64_t frames);

    const std::filesystem::path& path() const { return folder_; }

  private:
    bool check_list() const;
    void read_list();
    void check_free(const std::string& name) const;
    bool is_ours(const std::string& name) const;
    void write_list() const;
    std::filesystem::path folder_;
    std::set<std::string> listed_;
};

struct ExportOptions {
    std::filesystem::path folder;
    int fps = 30;               // frames a second, 1 at least
    int width = 0, height = 0;  // px of every frame
    bool panorama = false;      // frames show all directions: the files say so
    DisplaySettings display{};  // for every frame; without a photo there is no error to show
    CameraBlur blur{};          // of every frame; off: all is sharp
};

class PathExport {
  public:
    /// The last key is shown, too. Throws Error for a path without keys or with more than a million
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
    /// Whether all frames are there, so that only ffmpeg's part is left.
    bool has_frames() const { return next_ >= frames_; }
    /// Writes the next frame; `render` gives the picture of a camera. After the last frame it
    /// starts ffmpeg and deletes frames with higher numbers that an earlier export wrote. Further
    /// calls look whether ffmpeg has ended, or wait for that.
    using Render = std::function<ImageU8(const Camera&, const DisplaySettings&)>;
    void step(const Render& render, bool wait = false);
    /// Tells the user what was written.
    const std::string& summary() const { return summary_; }

  private:
    ImageU8 frame(const Render& render) const;
    void start_video();
    void watch_video(bool wait);
    CameraPath path_;
    ExportOptions options_;
    std::int64_t frames_, next_ = 0;
    ExportFolder folder_;
    std::unique_ptr<ChildProcess> ffmpeg_;  // while it runs
    bool done_ = false;
    std::string summary_;
};

}  // namespace darb
