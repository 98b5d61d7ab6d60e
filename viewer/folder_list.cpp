#include "viewer/folder_list.h"

#include <algorithm>

#include "engine/scene/splat_file.h"

namespace darb {

namespace {

constexpr std::size_t kMostEntries = 5'000;

}  // namespace

std::vector<FolderEntry> list_folder(const std::filesystem::path& folder) {
    std::vector<FolderEntry> entries;
    std::error_code error;
    for (std::filesystem::directory_iterator at(folder, error), end;
         !error && at != end && entries.size() < kMostEntries; at.increment(error)) {
        std::error_code none;
        const std::string name = at->path().filename().string();
        const bool is_folder = at->is_directory(none);
        const bool is_scene = at->is_regular_file(none) && names_scene(at->path());
        if (!name.starts_with('.') && (is_folder || is_scene)) entries.push_back({name, is_folder});
    }
    std::sort(entries.begin(), entries.end(), [](const FolderEntry& a, const FolderEntry& b) {
        return a.folder != b.folder ? a.folder : a.name < b.name;
    });
    return entries;
}

}  // namespace darb
