#include "tools/darb/photo_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/text.h"
#include "engine/data/colmap.h"
#include "engine/data/dataset.h"
#include "engine/data/image_io.h"
#include "engine/data/run_colmap.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMinPhotos = 3;

struct Pictures {
    std::vector<fs::directory_entry> photos;
    std::map<std::string, std::size_t> foreign;  // by extension
    fs::path cameras;                            // one file or folder of them
};

bool names_cameras(const std::string& name) {
    return name == "sparse" || (name.starts_with("transforms") && name.ends_with(".json"));
}

bool has_cameras(const fs::path& folder) {
    if (fs::exists(folder / "colmap" / "sparse") || is_colmap_model(folder)) return true;
    if (!project_of_photos(folder).empty()) return true;
    return std::any_of(fs::directory_iterator(folder), {}, [](const fs::directory_entry& entry) {
        return names_cameras(entry.path().filename().string());
    });
}

Pictures pictures_below(const fs::path& folder) {
    Pictures found;
    std::error_code none;  // no such folder: no entries
    for (fs::recursive_directory_iterator at(folder, none), end; at != end; ++at) {
        const std::string name = at->path().filename().string();
        if (name.starts_with('.')) {
            at.disable_recursion_pending();
        } else if (is_photo_name(name)) {
            found.photos.push_back(*at);
        } else if (is_foreign_picture_name(name)) {
            ++found.foreign[lower(at->path().extension().string())];
        } else if (names_cameras(name)) {
            found.cameras = at->path();
        }
    }
    return found;
}

std::string counts_of(const std::map<std::string, std::size_t>& foreign) {
    std::string list;
    for (const auto& [extension, count] : foreign)
        list += fmt::format("{}{} {}", list.empty() ? "" : ", ", count, extension);
    return list;
}

// The command that makes JPEG files of them, beside them.
std::string way_round(const std::map<std::string, std::size_t>& foreign, const fs::path& folder) {
    const std::string in = "cd " + shell_quoted(folder) + " && ";
    std::string text = "Convert them to PNG or JPEG first:";
    for (const auto& [extension, count] : foreign) {
        const bool phone = extension == ".heic" || extension == ".heif";
        text += fmt::format("\n    {}find . -iname '*{}' -exec {} \\;    ({})", in, extension,
                            phone ? "heif-convert -q 95 {} {}.jpg" : "convert {} {}.jpg",
                            phone ? "apt install libheif-examples" : "apt install imagemagick");
    }
    return text;
}

}  // namespace

fs::path photos_without_cameras(const fs::path& path, const std::string& images_folder) {
    if (!fs::is_directory(path) || has_cameras(path)) return {};
    if (!pictures_below(path / images_folder).photos.empty()) return path / images_folder;
    const Pictures found = pictures_below(path);
    if (!found.cameras.empty())
        throw Error(path.string(), "has no cameras, but " + found.cameras.string() + " is below it",
                    "Name the folder of one data set.");
    if (!found.photos.empty()) return path;
    if (!found.foreign.empty())
        throw Error(
            path.string(),
            "holds no PNG or JPEG files, but pictures not read: " + counts_of(found.foreign),
            way_round(found.foreign, path));
    return {};
}

PhotoList list_photos(const fs::path& folder) {
    std::vector<std::string> lines;
    std::set<std::pair<int, int>> sizes;
    const Pictures found = pictures_below(folder);
    for (const fs::directory_entry& entry : found.photos) {
        const ImageInfo info = read_image_info(entry.path());
        sizes.insert({info.width, info.height});
        lines.push_back(fmt::format("{} bytes {}\n", entry.file_size(),
                                    fs::relative(entry.path(), folder).string()));
    }
    if (lines.size() < kMinPhotos)
        throw Error(
            folder.string(),
            fmt::format("has no cameras, and {} photos are too few to find them", lines.size()),
            "Take 20 or more photos around the scene, each overlapping the next by 60 %.");
    std::sort(lines.begin(), lines.end());
    PhotoList list{{}, lines.size(), sizes.size() == 1, {}};
    if (!found.foreign.empty())
        list.left_out = counts_of(found.foreign) + " in " + folder.string() + " are not read. " +
                        way_round(found.foreign, folder);
    for (const std::string& line : lines) list.text += line;
    return list;
}

}  // namespace darb
