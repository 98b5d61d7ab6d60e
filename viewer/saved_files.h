// SavedFiles: which files the viewer may write over. Those that it wrote itself, and others when it
// is asked a second time.
#pragma once

#include <filesystem>
#include <set>

namespace darb {

class SavedFiles {
  public:
    /// Throws Error where the file is there, is not one of wrote(), and was not asked for the last
    /// time, too; and always where it is no plain file.
    void check(const std::filesystem::path& file);
    void wrote(const std::filesystem::path& file);

  private:
    std::set<std::filesystem::path> ours_;
    std::filesystem::path asked_for_;
};

}  // namespace darb
