// SPDX-License-Identifier: MIT
// The shaders of a web page in GLSL ES: sources of engine/publish/page with those of shaders/ that
// they include, where specialization constants become constants and what is never called is left
// out.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "engine/gpu/pipeline.h"
#include "engine/publish/page_splats.h"

namespace darb {

/// Where the shaders find the values of splats.
struct PageStorage {
    std::span<const PageColumn> columns = {};  // those of the page; empty: chunks of SOG
    bool shaped = false;                       // each splat has a shape
};

/// name: a file in engine/publish/page, such as "project.frag". Constants that are not given are as
/// declared. "stored.glsl" is made of the storage.
std::string page_shader(std::string_view name, const SpecConstants& constants,
                        const PageStorage& storage);

}  // namespace darb
