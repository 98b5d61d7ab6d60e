// Where a photo lies that a source names: names come from other systems, folders of smaller photos
// hold other formats, and formats that are not read were converted.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <set>

#include "engine/data/image_io.h"
#include "engine/data/source.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

constexpr const char* kExtensions[] = {".png", ".jpg", ".jpeg", ".PNG", ".JPG", ".JPEG"};

fs::path with_any_extension(const fs::path& path) {
    const bool is_there = fs::is_regular_file(path);
    if (is_there && !is_foreign_picture_name(path)) return path;
    const std::string stem = without_picture_extension(path).string();
    for (const char* extension : kExtensions)
        if (fs::path candidate = stem + extension; fs::is_regular_file(candidate)) return candidate;
    return is_there ? path : fs::path();
}

}  // namespace

fs::path tidy_path(const fs::path& path) {
    const fs::path tidy = path.lexically_normal();
    return tidy.has_filename() || tidy == tidy.root_path() ? tidy : tidy.parent_path();
}

std::string with_slashes(std::string name) {
    std::replace(name.begin(), name.end(), '\\', '/');
    return name;
}

std::string scaled_images(const fs::path& folder) {
    std::string first;
    std::error_code none;  // no such folder: no entries
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, none)) {
        const std::string name = entry.path().filename().string();
        if (name.starts_with("images_") && entry.is_directory() && (first.empty() || name < first))
            first = name;
    }
    return first;
}

fs::path find_by_end(const fs::path& folder, const std::string& name) {
    std::string rest = with_slashes(name);
    for (std::size_t slash = rest.find('/'); slash != std::string::npos; slash = rest.find('/')) {
        rest.erase(0, slash + 1);
        if (rest.empty() || rest.starts_with("..")) continue;
        if (fs::path found = with_any_extension(folder / rest); !found.empty()) return found;
    }
    return {};
}

std::string lower_case(std::string text) {
    std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
    return text;
}

std::vector<fs::path> folders_of(const fs::path& parent) {
    std::vector<fs::path> folders;
    std::error_code none;  // no such folder: no entries
    for (const fs::directory_entry& entry : fs::directory_iterator(parent, none))
        if (entry.is_directory(none) && !entry.path().filename().string().starts_with('.'))
            folders.push_back(entry.path());
    std::sort(folders.begin(), folders.end());
    return folders;
}

std::string unused_folders(const std::vector<fs::path>& parents,
                           std::initializer_list<std::string_view> words) {
    std::set<fs::path> seen;
    std::string list;
    for (const fs::path& parent : parents)
        for (const fs::path& folder : folders_of(parent)) {
            const std::string name = lower_case(folder.filename().string());
            if (std::ranges::none_of(words, [&](std::string_view word) {
                    return name.find(word) != std::string::npos;
                }))
                continue;
            std::error_code none;
            std::size_t files = 0;
            fs::path first;
            for (const auto& entry : fs::recursive_directory_iterator(folder, none)) {
                if (!entry.is_regular_file(none)) continue;
                if (files++ == 0 || entry.path() < first) first = entry.path();
            }
            if (files == 0 || !seen.insert(fs::absolute(folder).lexically_normal()).second)
                continue;
            list += fmt::format("{}{} ({}, the first being {})", list.empty() ? "" : "; ",
                                folder.string(), counted(files, "file"),
                                first.lexically_relative(folder).string());
        }
    return list;
}

fs::path find_photo(const fs::path& folder, const std::string& name) {
    fs::path found = with_any_extension(folder / name);
    if (found.empty() && name.find('\\') != std::string::npos)
        found = with_any_extension(folder / with_slashes(name));
    return found;
}

}  // namespace darb
