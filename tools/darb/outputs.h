// SPDX-License-Identifier: MIT
// The one rule for every file that a command writes: it must not be one that the command reads.
#pragma once

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/core/say.h"
#include "engine/data/dataset.h"
#include "engine/report/report.h"
#include "engine/scene/splat_file.h"

namespace darb {

using Paths = std::vector<std::filesystem::path>;

/// The files from which a scene, the output folder of a run, a data set or a list of cameras is
/// read, including itself. Photos come from files_of(views). The files need not exist; an empty
/// path has none.
Paths files_of(const std::filesystem::path& input);
/// Photos and masks.
Paths files_of(const std::vector<View>& views);

/// The files to which a scene is written.
Paths outputs_of(const std::filesystem::path& output, const EncodedSplats& encoded);

/// Which existing files a command replaces.
enum class Replaces {
    reports,  // numbers, pages and pictures; never a scene, and a picture only by a picture
    all       // any; the caller asks WrittenFiles
};
/// Throws Error where one of the outputs is one of the inputs (also through links), where two
/// outputs are the same file, or where an output exists that may not be replaced. Empty paths and
/// "-" do not count. Pipes and devices may be named twice.
void refuse_to_overwrite_inputs(const Paths& outputs, const Paths& inputs, Replaces replaces);
void refuse_to_overwrite_inputs(const Paths& outputs, const Paths& inputs);  // for reports

/// Which files darb may overwrite without being told: those that it wrote itself, from the same
/// scene. A record in the user's state folder tells; docs/formats.md has the rule.
class WrittenFiles {
  public:
    /// sources: the files from which the outputs are made; empty: any, as for frames. force:
    /// --force, which allows everything.
    WrittenFiles(const Paths& sources, bool force);

    /// Throws Error where one of the outputs exists and would be lost: a folder, or a file with
    /// content that the record does not know as written from these sources and unchanged since.
    /// Pipes and devices hold nothing; "-" and empty paths do not count.
    void check(const Paths& outputs) const;
    /// Remembers the outputs. Where there is no state folder, or it cannot be written, nothing is
    /// remembered.
    void wrote(const Paths& outputs) const;

  private:
    bool is_ours(const nlohmann::json& record, const std::filesystem::path& output) const;

    std::vector<std::string> sources_;  // sorted
    bool force_ = false;
    std::filesystem::path record_;  // empty: there is none
};

/// -q, the same in every command: only paths of what was written, warnings and errors are printed.
CLI::Option* add_quiet_flag(CLI::App& command, bool& quiet);
/// With `quiet` prints each path on a line of stdout; otherwise the text for people names them.
/// Empty paths and "-" do not count.
void tell_paths(bool quiet, const Paths& written);

/// Joins all lists.
Paths together(std::initializer_list<Paths> lists);

// What --json FILE means in every command that measures: the file gets every number. "-" is stdout,
// and the text for people then goes to stderr.

CLI::Option* add_json_option(CLI::App& command, std::filesystem::path& json);

/// --paper FOLDER, the same in every command that makes a report: its tables as CSV and LaTeX, its
/// plots as SVG and PDF.
CLI::Option* add_paper_option(CLI::App& command, std::filesystem::path& folder);

/// Throws Error where the folder is a file; before the work that makes the report.
void check_paper_folder(const std::filesystem::path& folder);

/// Writes the report's files into the folder; does nothing where that is empty. Throws Error, like
/// refuse_to_overwrite_inputs().
void write_paper(const std::filesystem::path& folder, const Report& report, const Paths& inputs);

/// The stream for text for people; null where quiet.
std::FILE* stream_beside_json(const std::filesystem::path& json, bool quiet);

/// Does nothing where the path is empty. On stdout the text is ASCII.
void write_json(const std::filesystem::path& to, const nlohmann::json& json);

/// `path` as it is written in that file: relative to the file's folder, or only the last name where
/// the two have no folder in common, so that the file tells nothing about the rest of the machine.
std::string name_in_json(const std::filesystem::path& to, const std::filesystem::path& path);

/// Replaces `path` by its last name in all texts, at any depth.
void leave_folders_out(nlohmann::json& texts, const std::filesystem::path& path);

// Notes on stderr about work that may take long; quick work has none.

class SlowProgress {
  public:
    /// what: for example "measuring".
    explicit SlowProgress(std::string what) : what_(std::move(what)) {}

    /// Prints "measuring: 12 pictures" or "palette: 40 %": nothing in the first 5 s, then a note
    /// every 5 s.
    void at(std::size_t count, const char* unit) { note(fmt::format("{} {}", count, unit)); }
    void at(double share) { note(fmt::format("{:.0f} %", 100 * share)); }

  private:
    using Clock = std::chrono::steady_clock;
    static constexpr std::chrono::seconds kBetween{5};

    void note(const std::string& text) {
        if (Clock::now() - last_ < kBetween) return;
        last_ = Clock::now();
        say_note(what_ + ": " + text);
    }

    std::string what_;
    Clock::time_point last_ = Clock::now();
};

}  // namespace darb
