// Where a photo lies that a source names: names come from other systems, folders of smaller photos
// hold other formats, and formats that are not read were converted.
#include <algorithm>

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

fs::path find_photo(const fs::path& folder, const std::string& name) {
    fs::path found = with_any_extension(folder / name);
    if (found.empty() && name.find('\\') != std::string::npos)
        found = with_any_extension(folder / with_slashes(name));
    return found;
}

}  // namespace darb
