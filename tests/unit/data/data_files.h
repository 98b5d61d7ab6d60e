// SPDX-License-Identifier: MIT
// The real data sets, scratch folders and hand-made files for reader tests.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "engine/core/error.h"
#include "tests/support/test_data.h"

namespace darb {

/// The folder of the data sets; a name that does not exist where there is none.
inline std::filesystem::path test_data() {
    return test::test_data_folder().value_or("no-test-data");
}

/// A fresh folder for the running test.
inline std::filesystem::path test_folder() {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    const auto folder = std::filesystem::temp_directory_path() / "darb_tests" /
                        (std::string(info->test_suite_name()) + "." + info->name());
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    return folder;
}

/// Bytes written field by field, for hand-made files.
struct Bytes {
    std::vector<std::byte> data;
    template <class T>
    Bytes& put(T value) {
        const auto* from = reinterpret_cast<const std::byte*>(&value);
        data.insert(data.end(), from, from + sizeof(T));
        return *this;
    }
    Bytes& text(const std::string& value) {
        for (const char c : value) put(c);
        return *this;
    }
};

/// The message of the Error that `call` throws; fails the test where it throws none.
template <class Call>
std::string error_of(Call&& call) {
    try {
        call();
    } catch (const Error& error) {
        return error.what();
    }
    ADD_FAILURE() << "no Error was thrown";
    return {};
}

}  // namespace darb

#define DARB_NEED_DATA(path) \
    if (!std::filesystem::exists(path)) GTEST_SKIP() << (path) << ": " << test::kNoTestData
