#include "trainer/portable_path.h"

#include <algorithm>

namespace darb {

namespace fs = std::filesystem;

namespace {

// Absolute, without a slash at the end.
fs::path whole(const fs::path& path) {
    std::error_code none;
    fs::path absolute = fs::absolute(path, none).lexically_normal();
    return absolute.has_filename() || absolute == absolute.root_path() ? absolute
                                                                       : absolute.parent_path();
}

fs::path place_of(const fs::path& path) {
    std::error_code none;
    const fs::path place = fs::weakly_canonical(path, none);
    return none ? path : place;
}

void replace_all(std::string& text, const std::string& from, const std::string& to) {
    if (from.size() < 2) return;  // "/" or "."
    for (size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
        text.replace(at, from.size(), to);
}

}  // namespace

fs::path seen_from(const fs::path& folder, const fs::path& path) {
    const fs::path absolute = whole(path), from = place_of(whole(folder));
    if (place_of(absolute) == from) return ".";
    const fs::path place = place_of(absolute.parent_path()) / absolute.filename();
    const fs::path relative = place.lexically_relative(from);
    return relative.empty() ? absolute : relative;
}

std::string shared_name(const fs::path& folder, const fs::path& path) {
    const fs::path seen = seen_from(folder, path), from = place_of(whole(folder));
    const auto up = std::count(seen.begin(), seen.end(), fs::path(".."));
    const auto depth = std::distance(from.begin(), from.end()) - 1;  // without the root
    return seen.is_absolute() || up >= depth ? whole(path).filename().string() : seen.string();
}

std::string without_folders(std::string text, const fs::path& path) {
    const std::string name = whole(path).filename().string();
    if (name.empty()) return text;
    replace_all(text, whole(path).string(), name);
    std::string typed = path.string();
    while (typed.size() > 1 && typed.ends_with('/')) typed.pop_back();
    if (typed.find('/') != std::string::npos) replace_all(text, typed, name);
    return text;
}

}  // namespace darb
