// Where a photo lies that a source names: names come from other systems, and folders of smaller
// photos hold other formats.
#include <algorithm>

#include "engine/core/files.h"
#include "engine/data/source.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

constexpr const char* kExtensions[] = {".png", ".jpg", ".jpeg", ".PNG", ".JPG", ".JPEG"};

fs::path with_any_extension(const fs::path& path) {
    if (fs::is_regular_file(path)) return path;
    const bool usual =
        has_extension(path, ".png") || has_extension(path, ".jpg") || has_extension(path, ".jpeg");
    for (const char* extension : kExtensions) {
        fs::path candidate = path;
        if (usual)
            candidate.replace_extension(extension);
        else
            candidate += extension;
        if (fs::is_regular_file(candidate)) return candidate;
    }
    return {};
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

fs::path find_photo(const fs::path& folder, const std::string& name) {
    fs::path found = with_any_extension(folder / name);
    if (found.empty() && name.find('\\') != std::string::npos)
        found = with_any_extension(folder / with_slashes(name));
    return found;
}

}  // namespace darb
