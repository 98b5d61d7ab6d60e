#include "tools/darb/video_photos.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/say.h"
#include "engine/data/colmap.h"
#include "engine/data/run_colmap.h"
#include "engine/data/video.h"
#include "trainer/portable_path.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

// Of a phone's 30 pictures a second two; enough to find cameras by, no more than COLMAP can match.
constexpr std::size_t kEvery = 15, kLeast = 60, kMost = 240;

// Both at once: a video needs both.
void need_programs(const fs::path& video) {
    std::string missing;
    for (const char* program : {"ffmpeg", "colmap"})
        if (!is_installed(program)) missing += (missing.empty() ? "" : " ") + std::string(program);
    if (missing.empty()) return;
    throw Error(video.string(),
                fmt::format("is a video: ffmpeg takes its pictures and colmap finds their cameras; "
                            "not installed: {}",
                            missing),
                fmt::format("apt install {}", missing));
}

// Which pictures lie in the folder, as frames.txt has it; it names no folder of the machine.
std::string key_of(const fs::path& video, const fs::path& output, int frames) {
    return fmt::format("{}\n{} bytes\n--frames {}\n", shared_name(output, video),
                       fs::file_size(video), frames);
}

constexpr std::string_view kUnfinished = "not all are written\n";

// Whether the pictures are there. Pictures that others put there are neither taken nor replaced.
bool has_pictures(const fs::path& folder, const fs::path& made, const std::string& key) {
    if (!fs::exists(made)) {
        if (fs::exists(folder) && !(fs::is_directory(folder) && fs::is_empty(folder)))
            throw Error(folder.string(), "is there, and not of this video",
                        "Name another output folder with -o.");
        return false;
    }
    const std::string text = read_text_file(made);
    if (text != key && text != key + std::string(kUnfinished))
        throw Error(folder.string(), "holds the pictures of another video, or another number",
                    "Name another output folder with -o.");
    return text == key;
}

}  // namespace

fs::path photos_of_video(const fs::path& video, TrainFlags& flags, std::optional<RunLock>& lock) {
    flags.sequential = true;
    const fs::path folder = flags.run.output / "frames", made = flags.run.output / "frames.txt";
    if (!fs::is_regular_file(video)) throw Error(video.string(), "is no file", "Check the path.");
    const std::string key = key_of(video, flags.run.output, flags.frames);
    if (has_pictures(folder, made, key)) return folder;
    need_programs(video);
    lock.emplace(flags.run.output);
    if (!flags.run.quiet) say("{}: looking for its sharpest pictures\n", video.string());
    const std::vector<double> sharpness = video_sharpness(video);
    const std::size_t wanted = flags.frames > 0
                                   ? static_cast<std::size_t>(flags.frames)
                                   : std::clamp(sharpness.size() / kEvery, kLeast, kMost);
    const std::vector<std::size_t> chosen = sharpest_of_intervals(sharpness, wanted);
    write_file_atomic(made, key + std::string(kUnfinished));  // a run that is ended here goes on
    write_video_frames(video, chosen, folder);
    write_file_atomic(made, key);
    if (!flags.run.quiet)
        say("{}: {} of {} pictures, the sharpest of each interval, are in {}\n", video.string(),
            chosen.size(), sharpness.size(), folder.string());
    return folder;
}

}  // namespace darb
