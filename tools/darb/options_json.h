// Every command and option, for man pages and for the completion of shells.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace darb {

/// What `darb --options-json` prints (hidden; tools/command_pages.py reads it). Without the options
/// that are accepted and mean nothing, or no more.
std::string options_json(const CLI::App& app);

}  // namespace darb
