// SPDX-License-Identifier: MIT
// Shell scripts in place of programs that the command calls, and a PATH on which they are found.
#pragma once

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "engine/core/files.h"
#include "tests/support/run_command.h"

namespace darb::test {

inline void write_fake_program(const std::filesystem::path& path, const std::string& script) {
    write_file_atomic(path, "#!/bin/sh\n" + script);
    std::filesystem::permissions(path, std::filesystem::perms::owner_all);
}

/// A script that notes each command in the file `calls` and the photos that it gets in
/// calls.photos, and answers with the photos and cameras of the folder `scene`.
inline void write_fake_colmap(const std::filesystem::path& path, const std::filesystem::path& calls,
                              const std::string& scene) {
    write_fake_program(
        path, fmt::format("echo \"$1\" >> '{0}'\n"
                          "command=$1\n"
                          "while [ $# -gt 1 ]; do\n"
                          "  [ \"$1\" = --output_path ] && out=$2\n"
                          "  [ \"$1\" = --image_path ] && ls \"$2\" > '{0}.photos'\n"
                          "  shift\n"
                          "done\n"
                          "case $command in\n"
                          "mapper) mkdir -p \"$out/0\"; cp '{1}'/sparse/0/* \"$out/0\" ;;\n"
                          "image_undistorter) mkdir -p \"$out/sparse\"\n"
                          "  cp '{1}'/sparse/0/* \"$out/sparse\"\n"
                          "  cp -r '{1}/images' \"$out\" ;;\n"
                          "esac\n",
                          calls.string(), scene));
}

/// Runs the command with this PATH.
inline Outcome with_path(const std::string& path, const std::string& arguments) {
    const std::string before = std::getenv("PATH");
    ::setenv("PATH", path.c_str(), 1);
    const Outcome o = darb(arguments);
    ::setenv("PATH", before.c_str(), 1);
    return o;
}

}  // namespace darb::test
