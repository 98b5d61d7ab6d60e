// SPDX-License-Identifier: MIT
// SavedFiles: which files the viewer may write over. Those that it wrote itself, and others when it
// is asked a second time.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace darb {

struct Session;

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

// The scenes that were opened last, kept in a file of the user.

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

// What a user turned a scene's up to, remembered by its file.

class RememberedUp {
  public:
    /// list: a JSON file that this class reads and writes; empty: nothing is remembered.
    explicit RememberedUp(std::filesystem::path list = {}) : list_(std::move(list)) {}

    /// Unit length; nothing where nothing is known or the list cannot be read.
    std::optional<glm::dvec3> find(const std::filesystem::path& scene) const;
    /// Keeps the latest 500 scenes. Throws Error where the list cannot be written; one that is no
    /// list of this kind stays as it is.
    void keep(const std::filesystem::path& scene, const glm::dvec3& up) const;

  private:
    std::filesystem::path list_;
};

// Recovery: what a session has not saved, in files of its own, where its window ends without a
// question: the display is gone, a signal comes, a device fails.

/// Writes the edited scene and the camera path that were not saved, beside the scene or, where that
/// cannot be written, into the current or the temporary folder: NAME_recovered.ply and
/// camera_path_recovered.json, with a number where those are there. Returns a sentence for each,
/// with the file or with why there is none; empty where nothing was unsaved. Never throws Error.
std::string recover_unsaved(const Session& session);

// What an open dialog lists of a folder: folders, and files that may hold splats.

struct FolderEntry {
    std::string name;
    bool folder = false;
};

/// Folders first, each in the order of names; hidden ones left out. Empty where the folder cannot
/// be read.
std::vector<FolderEntry> list_folder(const std::filesystem::path& folder);

}  // namespace darb
