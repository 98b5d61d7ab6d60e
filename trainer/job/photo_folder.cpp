// SPDX-License-Identifier: MIT
#include "trainer/job/photo_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/text.h"
#include "engine/data/colmap.h"
#include "engine/data/dataset.h"
#include "engine/data/image_io.h"
#include "engine/data/panorama_files.h"
#include "engine/data/run_colmap.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMinPhotos = 3;
constexpr std::size_t kHeadBytes = 1 << 18;  // EXIF and XMP are the first segments of a JPEG

struct Pictures {
    std::vector<fs::directory_entry> photos;
    std::map<std::string, std::size_t> foreign;  // how many, by extension
    fs::path cameras;                            // a file or folder of cameras
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

PhotoOrder order_of_photos(const std::vector<std::string>& names,
                           const std::vector<std::string>& times) {
    if (std::ranges::none_of(times, &std::string::empty) && !times.empty())
        return std::ranges::is_sorted(times) && times.front() != times.back() ? PhotoOrder::times
                                                                              : PhotoOrder::none;
    std::string pattern, last;
    for (const std::string& name : names) {
        const std::size_t point = std::min(name.rfind('.'), name.size());
        std::size_t begin = point;
        while (begin > 0 && name[begin - 1] >= '0' && name[begin - 1] <= '9') --begin;
        std::string number = name.substr(begin, point - begin);
        number.erase(0, std::min(number.find_first_not_of('0'), number.size() - 1));
        const std::string before = name.substr(0, begin);
        if (begin == point || (!last.empty() && before != pattern)) return PhotoOrder::none;
        const bool grows =
            last.size() < number.size() || (last.size() == number.size() && last < number);
        if (!last.empty() && !grows) return PhotoOrder::none;
        pattern = before;
        last = number;
    }
    return last.empty() ? PhotoOrder::none : PhotoOrder::numbers;
}

PhotoList list_photos(const fs::path& folder) {
    std::vector<std::string> lines, times;
    std::set<std::pair<int, int>> sizes;
    Pictures found = pictures_below(folder);
    std::ranges::sort(found.photos, {}, [](const auto& entry) { return entry.path().string(); });
    PhotoList list;
    for (const fs::directory_entry& entry : found.photos) {
        const ImageInfo info = read_image_info(entry.path());
        sizes.insert({info.width, info.height});
        list.names.push_back(fs::relative(entry.path(), folder).generic_string());
        const std::vector<std::byte> head = read_file_head(entry.path(), kHeadBytes);
        times.push_back(exif_time(head));
        list.marked_panoramas += is_marked_panorama(head) ? 1 : 0;
        list.twice_as_wide += info.width == 2 * info.height ? 1 : 0;
        lines.push_back(fmt::format("{} bytes {}\n", entry.file_size(), list.names.back()));
    }
    if (lines.size() < kMinPhotos)
        throw Error(
            folder.string(),
            fmt::format("has no cameras, and {} photos are too few to find them", lines.size()),
            "Take 20 or more photos around the scene, each overlapping the next by 60 %.");
    std::sort(lines.begin(), lines.end());
    list.one_size = sizes.size() == 1;
    list.order = order_of_photos(list.names, times);
    if (!found.foreign.empty())
        list.left_out = counts_of(found.foreign) + " in " + folder.string() + " are not read. " +
                        way_round(found.foreign, folder);
    for (const std::string& line : lines) list.text += line;
    return list;
}

}  // namespace darb
