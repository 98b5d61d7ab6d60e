// SPDX-License-Identifier: MIT
// What steps of an edit say of themselves.
#pragma once

#include <cstddef>
#include <string>

namespace darb {

/// "deleted 12 splats", "moved 1 splat".
std::string counted_splats(const char* verb, std::size_t count);

}  // namespace darb
