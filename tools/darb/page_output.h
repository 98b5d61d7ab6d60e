// SPDX-License-Identifier: MIT
// darb convert SCENE OUT.html: the options of a web page, and the page itself.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/scene/splat_model.h"

namespace darb {

struct PageFlags {
    std::string title, start_camera, background = "black";
    std::uint64_t max_bytes = 0;
    bool exact = false;
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

/// The views that open_cameras finds, at least one; empty where no cameras are named.
std::vector<View> named_views(const std::filesystem::path& cameras);

/// Where the scene is written to a pipe, which may be stdout, all messages go to stderr.
std::FILE* stream_beside(const std::filesystem::path& output);

}  // namespace darb
