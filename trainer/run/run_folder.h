// SPDX-License-Identifier: MIT
// The output folder of a run: one run at a time in it, nothing of an earlier one lost, and never
// the folder of the photos.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/core/system_files.h"
#include "engine/data/dataset.h"

namespace darb {

/// Holds OUT/run.lock, which the system lets go of however the process ends. Made before anything
/// else is written there; the file is removed when the lock is given back.
class RunLock {
  public:
    /// Makes the folder where it is missing. Throws Error where another process, which it names,
    /// trains into it, and where the folder cannot be written.
    explicit RunLock(const std::filesystem::path& folder);
    ~RunLock();
    RunLock(const RunLock&) = delete;
    RunLock& operator=(const RunLock&) = delete;

  private:
    std::filesystem::path path_;
    File file_;
};

/// What a run writes into its folder, as names of files and folders there.
bool is_of_run(const std::filesystem::path& name);

/// Moves what an earlier run left in the folder to the first OUT/earlier.N that is not there yet:
/// --resume and whatever looks for the folder's scene would take it for this one's. Never replaces
/// or deletes anything. Throws Error where something cannot be moved.
void set_aside(const std::filesystem::path& output);

/// Removes the temporary files that runs left in the folder which were killed while they wrote:
/// those that write_file_atomic makes for what a run writes, and no others. Under the lock.
void remove_leftovers(const std::filesystem::path& output);

/// Throws Error where the run would write among its own input: the folder of the data set itself,
/// one inside of a folder with its photos or cameras, or one in which the data set has a place that
/// a run writes to; links or not.
void check_run_folder(const std::filesystem::path& output, const Dataset& dataset);

// Paths that a run writes into its folder: as seen from there, so that folder and data can move
// together and say nothing of the rest of the machine.

/// path as seen from `folder`, by the places that both come to; a link at the end of path stays a
/// link. `folder` itself is ".".
std::filesystem::path seen_from(const std::filesystem::path& folder,
                                const std::filesystem::path& path);

/// The same for people: only the last name where the two have no folder in common but the root.
std::string shared_name(const std::filesystem::path& folder, const std::filesystem::path& path);

/// text with `path`, as it is and as an absolute path, replaced by its last name wherever it
/// stands.
std::string without_folders(std::string text, const std::filesystem::path& path);

}  // namespace darb
