// What an open dialog lists of a folder: folders, and files that may hold splats.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace darb {

struct FolderEntry {
    std::string name;
    bool folder = false;
};

/// Folders first, each in the order of names; hidden ones left out. Empty where the folder cannot
/// be read.
std::vector<FolderEntry> list_folder(const std::filesystem::path& folder);

}  // namespace darb
