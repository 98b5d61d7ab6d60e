// What is no data set, and the way from it to one.
#include <fmt/format.h>

#include <system_error>

#include "engine/core/error.h"
#include "engine/data/image_io.h"
#include "engine/data/run_colmap.h"
#include "engine/data/source.h"
#include "engine/data/video.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

std::string train_finds_cameras(const fs::path& path) {
    return fmt::format(
        "darb train finds them with COLMAP, and leaves OUT/colmap/dense as the data set:\n"
        "    darb train {} -o OUT",
        shell_quoted(path));
}

}  // namespace

void refuse_file(const fs::path& file) {
    if (is_video_name(file))
        throw Error(file.string(), "is a video, without cameras", train_finds_cameras(file));
    if (is_photo_name(file) || is_foreign_picture_name(file))
        throw Error(file.string(), "is one picture", "Name the folder of the photos.");
    throw Error(file.string(), "is neither a folder, a .json file nor a video",
                fmt::format("Name a COLMAP project, a folder of photos or with transforms.json, "
                            "that file, or a video ({}).",
                            video_extensions()));
}

void refuse_folder(const fs::path& folder) {
    fs::path video;
    std::error_code none;
    for (const fs::path& place : {folder, folder / kImages})
        for (const fs::directory_entry& entry : fs::directory_iterator(place, none)) {
            const fs::path& path = entry.path();
            if (path.filename().string().starts_with('.')) continue;
            if (is_photo_name(path) || is_foreign_picture_name(path))
                throw Error(folder.string(), "holds no cameras, but pictures",
                            train_finds_cameras(folder));
            if (is_video_name(path) && (video.empty() || path < video)) video = path;
        }
    if (!video.empty())
        throw Error(folder.string(), "holds no cameras and no photos, but a video",
                    fmt::format("Name the video: darb train {} -o OUT", shell_quoted(video)));
    throw Error(
        folder.string(),
        "holds no cameras: neither a COLMAP model (sparse/0 with cameras and images, .bin or "
        ".txt) nor transforms.json",
        "Name a data set, a folder of photos, or a video.");
}

}  // namespace darb
