// SPDX-License-Identifier: MIT
// The built darb command, as a user runs it. For tests that tests/CMakeLists.txt gives
// DARB_COMMAND.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/core/files.h"

namespace darb::test {

namespace fs = std::filesystem;

/// The shipped scene.
inline const std::string kScene = std::string(DARB_SOURCE_DIR) + "/assets/scene";

inline nlohmann::json read_json(const fs::path& path) {
    return nlohmann::json::parse(read_text_file(path));
}

// One a process: ctest may run the cases at once.
inline fs::path scratch() {
    const fs::path folder = fs::path(testing::TempDir()) / fmt::format("darb_{}", ::getpid());
    fs::create_directories(folder);
    return folder;
}

inline std::string scratch_file(const std::string& name) {
    return scratch() / name;
}

/// Keeps darb from reading or writing the user's own state.
inline const int kOwnState = ::setenv("XDG_STATE_HOME", scratch_file("state").c_str(), 1);

class RemoveScratch : public testing::Environment {
    void TearDown() override { fs::remove_all(scratch()); }
};
inline const testing::Environment* const kRemoveScratch =
    testing::AddGlobalTestEnvironment(new RemoveScratch);

struct Outcome {
    int code = -1;  // -1: killed by a signal
    std::string out, err;
};

inline Outcome darb(const std::string& arguments) {
    const std::string out = scratch() / "stdout", err = scratch() / "stderr";
    const int status = std::system(
        fmt::format("'{}' {} > '{}' 2> '{}'", DARB_COMMAND, arguments, out, err).c_str());
    const Outcome o{WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_text_file(out),
                    read_text_file(err)};
    EXPECT_EQ(o.err.find("vulkan validation:"), std::string::npos) << o.err;
    return o;
}

inline std::size_t count_png(const fs::path& folder) {
    return static_cast<std::size_t>(
        std::count_if(fs::directory_iterator(folder), fs::directory_iterator(),
                      [](const auto& entry) { return entry.path().extension() == ".png"; }));
}

struct BadCommand {
    std::string arguments, message;  // a part of what stderr says
};

inline void expect_refused(const std::vector<BadCommand>& commands) {
    for (const BadCommand& bad : commands) {
        const Outcome o = darb(bad.arguments);
        EXPECT_EQ(o.code, 2) << "darb " << bad.arguments << "\n" << o.err;
        EXPECT_NE(o.err.find(bad.message), std::string::npos)
            << "darb " << bad.arguments << ": no '" << bad.message << "' in\n"
            << o.err;
    }
}

}  // namespace darb::test
