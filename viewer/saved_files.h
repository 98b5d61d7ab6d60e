// SPDX-License-Identifier: MIT
// SavedFiles: which files the viewer may overwrite. It may overwrite those that it wrote itself,
// and others when it is asked a second time.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "viewer/input.h"

namespace darb {

struct Session;

class SavedFiles {
  public:
    /// Throws Error where the file exists, is not one of wrote(), and was not asked for the last
    /// time either. It always throws where the path is no plain file.
    void check(const std::filesystem::path& file);
    void wrote(const std::filesystem::path& file);

  private:
    std::set<std::filesystem::path> ours_;
    std::filesystem::path asked_for_;
};

// The scenes that were opened last, kept in a file of the user's.

class RecentFiles {
  public:
    /// list: a JSON file that this class reads and writes; where it is empty, nothing is kept.
    explicit RecentFiles(std::filesystem::path list = {}) : list_(std::move(list)) {}
    /// At most ten scenes that still exist, the latest first.
    std::vector<std::filesystem::path> read() const;
    /// Throws Error where the list cannot be written. A file that is no such list is left alone.
    void opened(const std::filesystem::path& scene) const;

  private:
    std::filesystem::path list_;
};

// The up direction that a user chose for a scene, remembered by the scene's file.

class RememberedUp {
  public:
    /// list: a JSON file that this class reads and writes; where it is empty, nothing is
    /// remembered.
    explicit RememberedUp(std::filesystem::path list = {}) : list_(std::move(list)) {}

    /// A unit vector, or nothing where none is known or the list cannot be read.
    std::optional<glm::dvec3> find(const std::filesystem::path& scene) const;
    /// Keeps the latest 500 scenes. Throws Error where the list cannot be written. A file that is
    /// no such list is left alone.
    void keep(const std::filesystem::path& scene, const glm::dvec3& up) const;

  private:
    std::filesystem::path list_;
};

// Recovery: writes what a session has not saved into new files where its window ends without a
// question, because the display is gone, a signal comes or a device fails.

/// Writes the edited scene, the mesh that was made and the camera path that were not saved. They go
/// beside the scene or, where that cannot be written, into the current or the temporary folder, as
/// NAME_recovered.ply, NAME_mesh_recovered.glb and camera_path_recovered.json, with a number where
/// those exist. Returns a sentence for each,
/// with the file or with the reason why there is none; empty where nothing was unsaved. Never
/// throws Error.
std::string recover_unsaved(const Session& session);

// What an open dialog lists of a folder: subfolders, and files that may hold splats, or else what a
// run can train on.

struct FolderEntry {
    std::string name;
    bool folder = false;
};

/// Folders first, each group in the order of names, without hidden ones. Empty where the folder
/// cannot be read.
std::vector<FolderEntry> list_folder(const std::filesystem::path& folder,
                                     OpenFor purpose = OpenFor::showing);

}  // namespace darb
