// The one rule for every file that a command writes: never one that it reads.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
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

/// Throws Error where one of the outputs is one of the inputs, by the file that they come to, links
/// or not, or where two outputs are one file. Empty paths and "-" do not count. Pipes and devices
/// may be named twice.
void refuse_to_overwrite_inputs(const Paths& outputs, const Paths& inputs);

/// -q, the same in every command: paths of what was written, warnings and errors are printed.
CLI::Option* add_quiet_flag(CLI::App& command, bool& quiet);
/// A line on stderr that is neither warning nor error: nothing after -q, whichever option took it.
void say_note(std::string_view line);
/// A line with each on stdout where quiet; who is not finds them in the text. Empty paths and "-"
/// do not count.
void tell_paths(bool quiet, const Paths& written);

/// All of them in one list.
Paths together(std::initializer_list<Paths> lists);

}  // namespace darb
