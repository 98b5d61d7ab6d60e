// SPDX-License-Identifier: MIT
// How many workgroups a pass over `count` items takes, in two dimensions where one does not
// suffice; shaders/lib/linear_id.glsl is the shader side.
#pragma once

#include <cstdint>

#include "shaders/shared/render_args.h"

namespace darb {

struct Groups {
    std::uint32_t x = 1, y = 1;
};

inline Groups groups_for(std::uint64_t count, std::uint32_t threads = SPLAT_GROUP) {
    const std::uint64_t n = count == 0 ? 1 : (count + threads - 1) / threads;
    const std::uint64_t y = (n + MAX_GROUPS - 1) / MAX_GROUPS;
    return {static_cast<std::uint32_t>((n + y - 1) / y), static_cast<std::uint32_t>(y)};
}

}  // namespace darb
