// The scenes that were opened last, kept in a file of the user.
#pragma once

#include <filesystem>
#include <vector>

namespace darb {

class RecentFiles {
  public:
    /// list: a JSON file that this class reads and writes; empty: nothing is kept.
    explicit RecentFiles(std::filesystem::path list = {}) : list_(std::move(list)) {}
    /// The latest first, at most ten, those that are still there.
    std::vector<std::filesystem::path> read() const;
    /// Throws Error where the list cannot be written; one that is no list of this kind stays.
    void opened(const std::filesystem::path& scene) const;

  private:
    std::filesystem::path list_;
};

}  // namespace darb
