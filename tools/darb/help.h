// SPDX-License-Identifier: MIT
// How the commands show their help, and how they answer a command line that they do not accept.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "engine/core/error.h"
#include "trainer/options/option_table.h"

namespace darb {

namespace help_group = option_group;

/// Whether --help leaves the options under this heading to --help-all.
bool is_for_few(const std::string& group);

/// Shows options under their headings, wrapped to the terminal's width (COLUMNS, or what the
/// terminal says, otherwise 80; at most 100). --help leaves out the headings for few users.
std::shared_ptr<CLI::Formatter> make_help_formatter();

/// The candidate nearest to a word that is not among them, or "" where none is near.
std::string nearest_name(const std::string& word, const std::vector<std::string>& candidates);

/// The error for an unknown command; it names the nearest command.
Error unknown_command(const CLI::App& app, const std::string& word);

/// The parser's error with the option, the reason and a remedy; an unknown option gets the nearest
/// one.
Error usage_error(const CLI::App& app, const CLI::ParseError& error);

// All commands and options, for man pages and for the completion of shells.

/// What `darb --options-json` prints (hidden; tools/command_pages.py reads it), without options
/// that are accepted but have no effect.
std::string options_json(const CLI::App& app);

}  // namespace darb
