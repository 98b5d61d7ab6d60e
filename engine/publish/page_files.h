// SPDX-License-Identifier: MIT
// The sources of the web page, and the shaders that it shares with darb, embedded at build time by
// cmake/embed.cmake.
#pragma once

#include <string_view>

namespace darb {

struct PageFile {
    std::string_view name;  // path from the root of the tree: "engine/publish/page/page.css"
    std::string_view text;
};

/// The list ends with an entry without a name.
extern const PageFile kPageFiles[];

/// The text of a file, by its path from the root; aborts where it is not embedded.
std::string_view page_file(std::string_view name);

}  // namespace darb
