// ExportFolder: where the frames and the video of a camera path go. It lists what it writes in a
// file of the folder, and replaces and deletes nothing that this list does not name.
#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>

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

    /// Reads the list of an earlier export, where there is one. Throws Error where a file of the
    /// list's name is something else, and where a name that an export of so many frames writes is
    /// somebody else's: not on the list, a link, a folder. Makes the folder where it is missing.
    ExportFolder(std::filesystem::path folder, std::int64_t frames);

    /// Puts a name on the list before it is written. Throws Error where that is somebody else's, or
    /// where the list cannot be written.
    std::filesystem::path claim(const std::string& name);
    /// The finished video takes its name.
    void keep_video();
    void drop_unfinished_video() const;
    /// Deletes the frames of an earlier export from number `frames` on, and takes what is no longer
    /// there from the list.
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

}  // namespace darb
