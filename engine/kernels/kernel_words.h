// SPDX-License-Identifier: MIT
// Kernels as people write them: a name, an expression, a file of their own.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace darb {

/// A kernel by its name or as "expr: ...", which is registered; its notes are added to `notes`.
/// Throws Error that names `option` for what is no kernel, and for a name with more than one pulse.
int kernel_of_word(const std::string& option, const std::string& word,
                   std::vector<std::string>& notes);

/// The same for a word after --kernel, which must name one kernel alone.
int kernel_of_option(const std::string& word, std::vector<std::string>& notes);

/// Registers the kernels of a file, in its order. Throws Error that names the file.
std::vector<int> kernels_of_file(const std::filesystem::path& path,
                                 std::vector<std::string>& notes);

/// The names that --kernel takes, with commas: built in, read from files, with shapes.
std::string kernel_names();
/// Those whose shape each splat learns.
std::string shaped_kernel_names();

}  // namespace darb
