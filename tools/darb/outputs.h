// The one rule for every file that a command writes: never one that it reads.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

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
void refuse_to_overwrite_inputs(const Paths& outputs, const Paths& inputs);  // of reports

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

}  // namespace darb
