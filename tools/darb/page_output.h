// darb convert SCENE OUT.html: options of a web page, and the page.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <filesystem>
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
};

void add_page_options(CLI::App& command, PageFlags& flags);

/// Whether the name asks for a web page.
bool is_page(const std::filesystem::path& output);

/// Throws Error where options of a page are given and the output is none.
void check_page_options(const PageFlags& flags, const std::filesystem::path& output);

/// Writes the page and returns a line about it. title: where the flags have none. views: its
/// bookmarks; none: eight around the scene.
std::string write_page(Device& device, const SplatModel& model, const PageFlags& flags,
                       const std::string& title, std::vector<View> views,
                       const std::filesystem::path& output);

/// Those that open_cameras finds, at least one; none where no cameras are named.
std::vector<View> named_views(const std::filesystem::path& cameras);

/// The name of a file or folder as a title.
std::string title_of(const std::filesystem::path& path);

/// Where the scene goes through a pipe, which may be stdout, all that is said goes to stderr.
std::FILE* stream_beside(const std::filesystem::path& output);

/// The same from the names of a command line, with the line printed to `say`; returns 0.
int convert_to_page(const SplatModel& model, const PageFlags& flags,
                    const std::filesystem::path& input, const std::filesystem::path& cameras,
                    const std::filesystem::path& output, const std::string& device, std::FILE* say);

}  // namespace darb
