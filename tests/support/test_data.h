// SPDX-License-Identifier: MIT
// Where the photo sets and scenes that some tests read lie.
//   const auto folder = test_data_folder();
//   if (!folder) GTEST_SKIP() << kNoTestData;
#pragma once

#include <filesystem>
#include <optional>

namespace darb::test {

inline constexpr const char* kNoTestData =
    "no test data: set DARB_TEST_DATA to its folder, or put it at ../shared/data";

/// $DARB_TEST_DATA, else <source>/../shared/data; nothing where that is no folder.
std::optional<std::filesystem::path> test_data_folder();

}  // namespace darb::test
