// What --json FILE means in every command that measures: every number in this file; "-" is stdout,
// and what is for people goes to stderr then.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace darb {

CLI::Option* add_json_option(CLI::App& command, std::filesystem::path& json);

/// Where text for people goes; null, nowhere, where quiet.
std::FILE* stream_beside_json(const std::filesystem::path& json, bool quiet);

/// Nothing where the path is empty. On stdout it is ASCII.
void write_json(const std::filesystem::path& to, const nlohmann::json& json);

/// `path` as it stands in that file: as seen from its folder, and only the last name where the two
/// have no folder in common, so that the file says nothing of the rest of the machine.
std::string name_in_json(const std::filesystem::path& to, const std::filesystem::path& path);

/// Texts, at any depth, with `path` replaced by its last name.
void leave_folders_out(nlohmann::json& texts, const std::filesystem::path& path);

}  // namespace darb
