// SPDX-License-Identifier: MIT
#include "trainer/job/scene_file.h"

#include <fmt/format.h>

#include <charconv>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/say.h"
#include "engine/core/text.h"
#include "engine/data/image_io.h"
#include "engine/data/video.h"
#include "trainer/job/edited_scene.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kPrefix = "iteration_";

// -1 where the folder is not named iteration_N.
long iteration_of(const fs::path& folder) {
    const std::string name = folder.filename().string();
    if (!name.starts_with(kPrefix)) return -1;
    long iteration = -1;
    const char* end = name.data() + name.size();
    const auto [rest, error] = std::from_chars(name.data() + kPrefix.size(), end, iteration);
    return error == std::errc{} && rest == end ? iteration : -1;
}

// Where the run of an output folder ended, which may be before the end of an earlier one; -1:
// unknown, as while it goes on.
long last_iteration(const fs::path& output) {
    std::error_code none;
    if (!fs::is_regular_file(output / "metrics.json", none)) return -1;
    const auto metrics =
        nlohmann::json::parse(read_text_file(output / "metrics.json"), nullptr, false);
    const auto at = metrics.is_object() ? metrics.find("iteration") : metrics.end();
    return at != metrics.end() && at->is_number_integer() ? at->get<long>() : -1;
}

// None where there is no such run or it held nothing out.
std::optional<HoldOut> hold_out_of_run(const fs::path& scene) {
    const fs::path log = log_of_run(scene);
    if (log.empty()) return std::nullopt;
    const nlohmann::json start = start_of_run(log);
    if (!start.is_object()) return std::nullopt;
    const auto at = start.find("hold_out");
    const std::string text =
        at != start.end() && at->is_string() ? at->get<std::string>() : std::string();
    if (text.empty()) return std::nullopt;
    return while_doing(log.string(), [&] { return parse_hold_out(text); });
}

bool has_photos(const fs::path& folder) {
    std::error_code none;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, none))
        if (is_photo_name(entry.path()) && entry.is_regular_file(none)) return true;
    return false;
}

bool holds_cameras(const fs::path& folder) {
    std::error_code none;
    for (const char* name : {"transforms.json", "transforms_train.json", "sparse", "colmap",
                             "cameras.bin", "cameras.txt"})
        if (fs::exists(folder / name, none)) return true;
    return false;
}

/// What it is in place of a scene, and what to type; nothing where nobody can tell.
struct Other {
    std::string what, hint;
};

std::optional<Other> other_folder(const fs::path& path) {
    std::error_code none;
    const std::string name = printable(path.string());
    if (fs::is_regular_file(path / "run.jsonl", none) || fs::exists(path / "run.lock", none))
        return Other{"is the folder of a run that has not saved a scene yet",
                     "Wait for its first save (darb train --save-iterations says when), or go on "
                     "with it where it was stopped: darb train DATASET -o " +
                         name + " --resume."};
    const std::string train =
        "Train a scene first: darb train " + name + " -o OUT. Then look at it: darb view OUT.";
    if (holds_cameras(path))
        return Other{"is a data set, photos with cameras, and no scene", train};
    if (has_photos(path) || has_photos(path / "images"))
        return Other{"is a folder of photos, and no scene", train};
    return {};
}

std::optional<Other> other_file(const fs::path& path) {
    std::error_code none;
    if (!fs::is_regular_file(path, none)) return {};
    const std::string name = printable(path.string());
    if (is_video_name(path))
        return Other{"is a video, and no scene",
                     "Train a scene first: darb train " + name + " -o OUT. Then: darb view OUT."};
    if (is_photo_name(path))
        return Other{"is a picture, and no scene",
                     "Name a splat file, or train a scene of a folder of photos: darb train FOLDER "
                     "-o OUT."};
    if (has_extension(path, ".darb"))
        return Other{"is the checkpoint of a run, and no scene",
                     "Name the folder of the run, which holds its scene; darb train DATASET -o OUT "
                     "--resume goes on from the checkpoint."};
    if (has_extension(path, ".html") || has_extension(path, ".htm"))
        return Other{"is a web page, and no scene", "Open it in a browser."};
    if (has_extension(path, ".json") && !names_scene_folder(path) && !is_project_file(path))
        return Other{"is no scene: cameras and camera paths are .json files",
                     "Name the scene, and cameras after --cameras, a path after --path."};
    return {};
}

}  // namespace

bool can_train_on(const fs::path& path) {
    std::error_code none;
    if (!fs::is_directory(path, none)) return is_video_name(path);
    const bool run = fs::exists(path / "run.jsonl", none) || fs::exists(path / "run.lock", none);
    return !run && (holds_cameras(path) || has_photos(path) || has_photos(path / "images"));
}

fs::path log_of_run(const fs::path& scene) {
    std::error_code none;
    fs::path folder = fs::absolute(scene, none), log = folder / "run.jsonl";
    constexpr int kDeepest = 3;  // OUT/point_cloud/iteration_N/point_cloud.ply
    for (int up = 0; up < kDeepest && !fs::is_regular_file(log, none); ++up) {
        folder = folder.parent_path();
        log = folder / "run.jsonl";
    }
    return fs::is_regular_file(log, none) ? log : fs::path();
}

nlohmann::json start_of_run(const fs::path& log) {
    nlohmann::json start;
    std::ifstream lines(log);
    for (std::string line; std::getline(lines, line);) {
        nlohmann::json event = nlohmann::json::parse(line, nullptr, false);
        if (event.is_object() && event.value("event", nlohmann::json()) == "start")
            start = std::move(event);
    }
    return start;
}

void hold_out_as_trained(const fs::path& scene, DatasetOptions& data) {
    if (!data.hold_out) data.held_out = hold_out_of_run(scene).value_or(HoldOut{});
    data.hold_out = true;
    if (data.held_out != HoldOut{}) say_note("held out: " + hold_out_text(data.held_out));
}

fs::path scene_of_run(const fs::path& output) {
    fs::path found;
    long latest = -1;
    const long own = last_iteration(output);
    std::error_code none;  // no such folder: no entries
    for (const fs::directory_entry& entry : fs::directory_iterator(output / "point_cloud", none)) {
        const long iteration = iteration_of(entry.path());
        const fs::path scene = entry.path() / "point_cloud.ply";
        if (iteration < 0 || !fs::is_regular_file(scene)) continue;
        if (iteration != own && (latest == own || iteration < latest) && !found.empty()) continue;
        latest = iteration;
        found = scene;
    }
    return found;
}

fs::path find_scene(const fs::path& path) {
    if (!fs::is_directory(path)) {
        if (const auto other = other_file(path))
            throw Error(path.string(), other->what, other->hint);
        return path;
    }
    if (scene_file_in(path)) return path;
    const fs::path found = scene_of_run(path);
    if (found.empty()) {
        if (const auto other = other_folder(path))
            throw Error(path.string(), other->what, other->hint);
        throw Error(path.string(),
                    "is a folder without point_cloud/iteration_N/point_cloud.ply and without the "
                    "meta.json of a SOG scene",
                    "Name a splat file, a SOG folder, or the output folder of darb train.");
    }
    return found;
}

bool is_scene(const fs::path& path) {
    if (fs::is_regular_file(path)) return path.extension() != ".json" || is_project_file(path);
    return fs::exists(path / "point_cloud") || scene_file_in(path);
}

SplatModel load_scene(const fs::path& path, SplatFile* facts, const StoredUnits& units) {
    if (is_project_file(path)) {
        const EditedScene scene = load_edited_scene(path, facts, units);
        for (const std::string& loss : scene.edit.losses_together())
            say("warning: {}: {}\n", path.string(), loss);
        return scene.saved();
    }
    const fs::path file = find_scene(path);
    SplatFile unused;
    SplatFile& said = facts ? *facts : unused;
    SplatModel model = while_doing(file.string(), [&] { return load_splats(file, &said, units); });
    if (said.dropped > 0)
        say("warning: {}: {} splats with NaN or infinity were dropped\n", file.string(),
            said.dropped);
    for (const std::string& note : said.notes) say("warning: {}: {}\n", file.string(), note);
    return model;
}

EditedScene load_edited_scene(const fs::path& path, SplatFile* facts, const StoredUnits& units) {
    if (is_project_file(path)) {
        const Project project = read_project(path);
        for (const std::string& note : changed_files(project, path.string()))
            say("warning: {}: {}\n", path.string(), note);
        return perform_project(project, path.string(), [&](const fs::path& file) {
            if (is_project_file(file))
                throw Error(file.string(),
                            "is a project, and a project cannot be a layer of another",
                            "Save its layers together as one file, and name that.");
            SplatFile part;
            SplatModel model = load_scene(file, &part, units);
            if (facts == nullptr) return model;
            part.bytes += facts->bytes;
            part.dropped += facts->dropped;
            part.notes.insert(part.notes.begin(), facts->notes.begin(), facts->notes.end());
            part.up = facts->bytes == 0 ? part.up : facts->up;  // that of the first
            *facts = std::move(part);
            return model;
        });
    }
    EditedScene scene;
    scene.model = load_scene(path, facts, units);
    scene.edit = Edit(scene.model, scene_name(path), find_scene(path));
    return scene;
}

}  // namespace darb
