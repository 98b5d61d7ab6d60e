// SPDX-License-Identifier: MIT
#include "tests/support/test_data.h"

#include <cstdlib>

namespace darb::test {

std::optional<std::filesystem::path> test_data_folder() {
    const char* named = std::getenv("DARB_TEST_DATA");
    const std::filesystem::path folder =
        named ? std::filesystem::path(named)
              : std::filesystem::path(DARB_SOURCE_DIR) / ".." / "shared" / "data";
    std::error_code error;
    if (!std::filesystem::is_directory(folder, error)) {
        return std::nullopt;
    }
    return folder;
}

}  // namespace darb::test
