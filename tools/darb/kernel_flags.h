// Kernels on the command line: names, expressions, files and lists of them.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/kernels/kernel_words.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// --kernel and --kernel-file of a command that takes one kernel.
struct KernelFlags {
    std::string kernel;  // empty: not given
    std::vector<std::filesystem::path> files;
};

/// Both options, kernel's with this help.
void add_kernel_flags(CLI::App& command, KernelFlags& flags, const std::string& help,
                      const std::string& group = "OPTIONS");
/// --kernel-file alone.
CLI::Option* add_kernel_file_flag(CLI::App& command, std::vector<std::filesystem::path>& files);

/// Registers the kernels of the files, in order; prints what should be said of them. Throws Error.
std::vector<int> kernels_of_files(const std::vector<std::filesystem::path>& files);

/// What --kernel names, by name or "expr: ...", else the last kernel of the files; nothing where
/// neither is given. Throws Error, for a row with more than one pulse too.
std::optional<int> chosen_kernel(const KernelFlags& flags);

/// The splats in the chosen kernel, if one is; with its psi where it has no exact footprint.
SplatModel in_kernel(const KernelFlags& flags, SplatModel model);

/// A list as split_kernel_list has it, in which "all" are the nine of the family and "paper" the
/// five of the paper's tables, and behind it the kernels of the files; to kernels without repeats.
/// Throws Error naming `option` for an item that is no kernel, or one with more than one pulse.
std::vector<int> kernels_from_list(const std::string& option, const std::string& list,
                                   const std::vector<std::filesystem::path>& files = {});

}  // namespace darb
