// SPDX-License-Identifier: MIT
// The one rule for every file that a command writes: never one that it reads.
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
#include "engine/scene/splat_file.h"

namespace darb {

using Paths = std::vector<std::filesystem::path>;

/// What a scene, the output folder of a run, a data set or a list of cameras is read from, itself
/// among them; the photos are those of files_of(views). Names need not be there; an empty path has
/// none.
Paths files_of(const std::filesystem::path& input);
/// Photos and masks.
Paths files_of(const std::vector<View>& views);

/// What a scene is written to.
Paths outputs_of(const std::filesystem::path& output, const EncodedSplats& encoded);

/// What a command replaces where it is there.
enum class Replaces {
    reports,  // numbers, pages and pictures: never a scene, and a picture only by a picture
    all       // the caller asks WrittenFiles
};
/// Throws Error where one of the outputs is one of the inputs, by the file that they come to, links
/// or not, where two outputs are one file, or where one is there that is not replaced. Empty paths
/// and "-" do not count. Pipes and devices may be named twice.
void refuse_to_overwrite_inputs(const Paths& outputs, const Paths& inputs, Replaces replaces);
void refuse_to_overwrite_inputs(const Paths& outputs, const Paths& inputs);  // for reports

/// Which files darb may write over without being told: those that it wrote itself, from the same
/// scene. A record in the user's state folder says so; docs/formats.md has the rule.
class WrittenFiles {
  public:
    /// sources: what the outputs are made from; none: any, as of frames. force: --force, which
    /// allows everything.
    WrittenFiles(const Paths& sources, bool force);

    /// Throws Error where one of the outputs is there and would be lost: a folder, or a file with
    /// content that the record does not know as written from these sources and untouched since.
    /// Pipes and devices hold nothing; "-" and empty paths do not count.
    void check(const Paths& outputs) const;
    /// Remembers them. Where there is no state folder, or it cannot be written, nothing is.
    void wrote(const Paths& outputs) const;

  private:
    bool is_ours(const nlohmann::json& record, const std::filesystem::path& output) const;

    std::vector<std::string> sources_;  // sorted
    bool force_ = false;
    std::filesystem::path record_;  // empty: there is none
};

/// -q, the same in every command: paths of what was written, warnings and errors are printed.
CLI::Option* add_quiet_flag(CLI::App& command, bool& quiet);
/// A line with each on stdout where quiet; who is not finds them in the text. Empty paths and "-"
/// do not count.
void tell_paths(bool quiet, const Paths& written);

/// All of them in one list.
Paths together(std::initializer_list<Paths> lists);

// What --json FILE means in every command that measures: every number in this file; "-" is stdout,
// and what is for people goes to stderr then.

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

// Notes on stderr about work that may take long: nothing of what is quick.

class SlowProgress {
  public:
    /// what: as "measuring".
    explicit SlowProgress(std::string what) : what_(std::move(what)) {}

    /// "measuring: 12 pictures", "palette: 40 %"; none in the first 5 s, then one every 5 s.
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
