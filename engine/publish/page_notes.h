// SPDX-License-Identifier: MIT
// Notes at places of a scene, as web pages show them: a JSON file with a list `notes`, which may
// hold anything else beside it.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/data/dataset.h"

namespace darb {

struct PageNote {
    glm::dvec3 at{0.0};  // world
    std::string title, text;
    std::optional<View> view;  // from which to look at it
};

/// Reads {"notes": [{"at": [x, y, z], "title": "...", "text": "...", "camera": {...}}]}. A title is
/// needed or a text; a camera is a record of cameras.json, without its name, or has the
/// form of a project's notes (docs/formats.md). Other members are ignored. Throws Error naming the
/// note, and for more than 1,000 of them.
std::vector<PageNote> read_page_notes(const std::filesystem::path& path);

}  // namespace darb
