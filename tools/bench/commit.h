// SPDX-License-Identifier: MIT
// The commit that the program was built from.
#pragma once

#include <string_view>

namespace darb {

/// Abbreviated hash, with "-dirty" where tracked files differed from it; "unknown" outside of git.
std::string_view build_commit();

}  // namespace darb
