// SPDX-License-Identifier: MIT
// Edits as JSON: {"darb_edits": 1, "edits": [{"op": "select", "by": "sphere", ...}, ...]}. What the
// window writes and `darb edit` reads; a project (project_file.h) holds the same list.
// docs/formats.md has every operation with its keys.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "engine/scene/edit_operation.h"

namespace darb {

/// folder: the one from which the names of files count. Throws Error naming the edit and the key.
std::vector<EditOperation> parse_edit_script(std::string_view text, const std::string& where,
                                             const std::filesystem::path& folder);
/// Reads to the same operations, number by number.
std::string format_edit_script(const std::vector<EditOperation>& operations,
                               const std::filesystem::path& folder);

std::vector<EditOperation> read_edit_script(const std::filesystem::path& file);
void write_edit_script(const std::filesystem::path& file,
                       const std::vector<EditOperation>& operations);

/// The list alone, as a project holds it.
nlohmann::json json_of_edits(const std::vector<EditOperation>& operations,
                             const std::filesystem::path& folder);
std::vector<EditOperation> edits_of_json(const nlohmann::json& list, const std::string& where,
                                         const std::string& hint,
                                         const std::filesystem::path& folder);

/// The file as it is named in a file of this folder: relative where both are on one drive, with
/// slashes.
std::string name_from(const std::filesystem::path& folder, const std::filesystem::path& file);
/// Back again.
std::filesystem::path file_from(const std::filesystem::path& folder, const std::string& name);

/// A selector as a word of the command line: all, sphere:X,Y,Z,RADIUS,
/// box:MINX,MINY,MINZ,MAXX,MAXY,MAXZ, opacity:LOW,HIGH, size:LOW,HIGH, colour:R,G,B,WITHIN,
/// isolated:SHARE, haze:OPACITY,SIZE or layer:NAME. Throws Error naming the option.
Selector selector_from_text(const std::string& option, const std::string& text);

}  // namespace darb
