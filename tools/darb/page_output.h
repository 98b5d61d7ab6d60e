// SPDX-License-Identifier: MIT
// darb convert SCENE OUT.html: the options of a web page, and the page itself.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_file.h"
#include "engine/scene/splat_model.h"
#include "tools/darb/outputs.h"

namespace darb {

/// Where a point of a scene goes when the scene is moved.
inline glm::dvec3 moved_point(const Similarity& similarity, const glm::dvec3& point) {
    return similarity.scale * (similarity.turn * point) + similarity.translation;
}
/// Moves a camera along with the scene: it sees the same, and distances grow with the scene.
void move_camera(const Similarity& similarity, Camera& camera);

struct PageFlags {
    std::string title, start_camera, background = "black";
    std::uint64_t max_bytes = 0;
    bool exact = false, web = false;
    std::filesystem::path notes, collider;
    std::string walk, poster = "still";
    Similarity moved;  // of the scene, which notes and the collider are turned with
    // unit vector, world; absent: as the views are held, otherwise a guess
    std::optional<glm::dvec3> up;
};

void add_page_options(CLI::App& command, PageFlags& flags);

/// Whether the name asks for a web page.
bool is_page(const std::filesystem::path& output);

/// Throws Error where options of a page are given and the output is not a page.
void check_page_options(const PageFlags& flags, const std::filesystem::path& output);

/// Writes the page and returns a line about it. title: used where the flags have none. views:
/// become the bookmarks; where empty, eight around the scene.
std::string write_page(Device& device, const SplatModel& model, const PageFlags& flags,
                       const std::string& title, std::vector<View> views,
                       const std::filesystem::path& output);

/// A streamed scene in a folder: index.html, lod-meta.json, and a folder for each of its files.
struct WebFolder {
    std::filesystem::path folder;
    std::vector<std::size_t> counts;          // splats of the levels below the scene, falling
    AssignRows assign_rows;                   // as EncodeOptions has it
    std::function<void(const Paths&)> check;  // throws where one of the files must not be written
};
/// The levels that a streamed scene has by default: quarters, down to a few thousand splats.
std::vector<std::size_t> web_levels(std::size_t splats);
/// Writes it and returns a line about it; `written` receives its files. As write_page.
std::string write_web_folder(Device& device, SplatModel& model, const PageFlags& flags,
                             const std::string& title, std::vector<View> views, const WebFolder& to,
                             Paths& written);

/// The views that open_cameras finds, at least one; empty where no cameras are named.
std::vector<View> named_views(const std::filesystem::path& cameras);

/// Where the scene is written to a pipe, which may be stdout, all messages go to stderr.
std::FILE* stream_beside(const std::filesystem::path& output);

}  // namespace darb
