// SPDX-License-Identifier: MIT
#include "viewer/saved_files.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/text.h"
#include "engine/data/video.h"
#include "engine/mesh/mesh_file.h"
#include "engine/scene/splat_file.h"
#include "viewer/session.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

// Gives one name to a file, whatever path leads to it.
fs::path known_as(const fs::path& file) {
    std::error_code none;
    const fs::path whole = fs::weakly_canonical(fs::absolute(file), none);
    return none ? file : whole;
}

}  // namespace

void SavedFiles::check(const fs::path& file) {
    std::error_code none;
    const fs::file_type kind = fs::status(file, none).type();
    const fs::path before = std::exchange(asked_for_, known_as(file));
    if (kind == fs::file_type::not_found || ours_.contains(asked_for_)) return;
    if (kind != fs::file_type::regular)
        throw Error(file.string(), "exists, and is not a plain file", "Choose another name.");
    if (before == asked_for_) return;
    throw Error(file.string(), "already exists; nothing was written",
                "Choose another name, or save again to replace it.");
}

void SavedFiles::wrote(const fs::path& file) {
    ours_.insert(known_as(file));
    asked_for_.clear();
}

namespace {

constexpr std::size_t kMostRecent = 10;

// Nothing where the file is something else; empty where it does not exist.
std::optional<std::vector<std::string>> read_recent(const std::filesystem::path& list) {
    if (!std::filesystem::exists(list)) return std::vector<std::string>();
    try {
        return nlohmann::json::parse(read_text_file(list))
            .at("scenes")
            .get<std::vector<std::string>>();
    } catch (const std::exception&) {
        return {};
    }
}

}  // namespace

std::vector<std::filesystem::path> RecentFiles::read() const {
    std::vector<std::filesystem::path> files;
    if (list_.empty()) return files;
    const std::optional<std::vector<std::string>> names = read_recent(list_);
    if (!names) return files;
    for (const std::string& name : *names) {
        std::error_code none;
        if (std::filesystem::exists(name, none)) files.emplace_back(name);
    }
    return files;
}

void RecentFiles::opened(const std::filesystem::path& scene) const {
    if (list_.empty()) return;
    std::optional<std::vector<std::string>> names = read_recent(list_);
    if (!names) return;
    std::filesystem::path path = std::filesystem::absolute(scene).lexically_normal();
    // a folder may be named with a slash at its end
    if (!path.has_filename()) path = path.parent_path();
    const std::string name = path.string();
    std::erase(*names, name);
    names->insert(names->begin(), name);
    names->resize(std::min(names->size(), kMostRecent));
    std::filesystem::create_directories(list_.parent_path());
    const nlohmann::json json{{"scenes", *names}};
    write_file_atomic(list_,
                      json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::size_t kMostScenes = 500;

std::string key_of(const fs::path& scene) {
    std::error_code error;
    const fs::path whole = fs::weakly_canonical(fs::absolute(scene), error);
    return (error ? scene : whole).string();
}

/// [{"scene": path, "up": [x, y, z]}, ...], latest last.
json read_list(const fs::path& list) {
    if (list.empty() || !fs::is_regular_file(list)) return json::array();
    json entries = json::parse(read_text_file(list), nullptr, false);
    if (!entries.is_array())
        throw Error(list.string(), "is not a list of scenes with their up directions",
                    "Move it away, and a new one is made.");
    return entries;
}

bool is_of(const json& entry, const std::string& key) {
    return entry.is_object() && entry.contains("scene") && entry["scene"].is_string() &&
           entry["scene"] == key;
}

}  // namespace

std::optional<glm::dvec3> RememberedUp::find(const fs::path& scene) const {
    try {
        const std::string key = key_of(scene);
        for (const json& entry : read_list(list_)) {
            if (!is_of(entry, key) || !entry.contains("up")) continue;
            const auto up = entry["up"].get<std::vector<double>>();
            const glm::dvec3 v = up.size() == 3 ? glm::dvec3(up[0], up[1], up[2]) : glm::dvec3(0.0);
            if (std::isfinite(glm::length(v)) && glm::length(v) > 0.5) return glm::normalize(v);
        }
    } catch (const std::exception&) {  // treated as if nothing were known
    }
    return {};
}

void RememberedUp::keep(const fs::path& scene, const glm::dvec3& up) const {
    if (list_.empty()) return;
    json entries = read_list(list_);
    const std::string key = key_of(scene);
    json kept = json::array();
    for (json& entry : entries)
        if (!is_of(entry, key)) kept.push_back(std::move(entry));
    kept.push_back({{"scene", key}, {"up", {up.x, up.y, up.z}}});
    while (kept.size() > kMostScenes) kept.erase(kept.begin());
    fs::create_directories(list_.parent_path());
    write_file_atomic(list_, kept.dump(1, ' ', false, json::error_handler_t::replace) + "\n");
}

namespace {

namespace fs = std::filesystem;

// No existing name is used, not even that of a link that leads nowhere.
fs::path free_name(const fs::path& folder, const std::string& stem, const std::string& extension) {
    for (int n = 1;; ++n) {
        const std::string number = n == 1 ? "" : fmt::format("_{}", n);
        const fs::path file = folder / (stem + "_recovered" + number + extension);
        std::error_code none;
        if (fs::symlink_status(file, none).type() == fs::file_type::not_found) return file;
    }
}

// Returns a sentence that says where the file is, or why it is lost.
std::string keep(const char* what, const fs::path& beside, const std::string& stem,
                 const std::string& extension, const std::function<void(const fs::path&)>& write) {
    std::error_code none;
    std::string reason;
    for (const fs::path& folder :
         {beside.parent_path(), fs::path("."), fs::temp_directory_path(none)}) {
        try {
            const fs::path file = free_name(folder, stem, extension);
            write(file);
            return fmt::format("{} that was not saved is in {}", what, file.string());
        } catch (const std::exception& e) {
            reason = e.what();
        }
    }
    return fmt::format("{} that was not saved is lost: {}", what, reason);
}

}  // namespace

std::string recover_unsaved(const Session& s) {
    std::string said;
    if (s.scene && s.edit.unsaved())
        said = keep("The edited scene", s.save_file, scene_name(s.scene->file), ".ply",
                    [&](const fs::path& file) {
                        save_splats(file, SplatFormat::ply, s.edit.apply(s.scene->model));
                    });
    if (s.scene && s.edit.unsaved() && keeps_project(s))
        said +=
            ". " + keep("The project", s.project.to_save, scene_name(s.scene->file), ".darb.json",
                        [&](const fs::path& file) { write_project(file, project_of_session(s)); });
    if (unsaved_mesh(s))
        said += (said.empty() ? "" : ". ") +
                keep("The mesh", s.mesh_file, s.mesh_file.stem().string(), ".glb",
                     [&](const fs::path& file) { write_mesh(file, s.mesh->mesh); });
    if (s.path.unsaved())
        said += (said.empty() ? "" : ". ") +
                keep("The camera path", s.path.file, s.path.file.stem().string(), ".json",
                     [&](const fs::path& file) { write_camera_path(file, s.path.path); });
    return said.empty() ? said : said + ".";
}

namespace {

constexpr std::size_t kMostEntries = 5'000;

}  // namespace

std::vector<FolderEntry> list_folder(const std::filesystem::path& folder, OpenFor purpose) {
    std::vector<FolderEntry> entries;
    std::error_code error;
    for (std::filesystem::directory_iterator at(folder, error), end;
         !error && at != end && entries.size() < kMostEntries; at.increment(error)) {
        std::error_code none;
        const std::string name = at->path().filename().string();
        const bool is_folder = at->is_directory(none);
        const bool listed = purpose == OpenFor::training
                                ? is_video_name(at->path()) || has_extension(at->path(), ".json")
                                : names_scene(at->path()) || has_extension(at->path(), ".obj") ||
                                      is_project_file(at->path());
        if (!name.starts_with('.') && (is_folder || (listed && at->is_regular_file(none))))
            entries.push_back({name, is_folder});
    }
    std::sort(entries.begin(), entries.end(), [](const FolderEntry& a, const FolderEntry& b) {
        return a.folder != b.folder ? a.folder : a.name < b.name;
    });
    return entries;
}

}  // namespace darb
