// SPDX-License-Identifier: MIT
#include "engine/publish/page_files.h"

#include "engine/core/error.h"

namespace darb {

std::string_view page_file(std::string_view name) {
    const PageFile* file = kPageFiles;
    while (!file->name.empty() && file->name != name) ++file;
    DARB_CHECK(!file->name.empty(), "{} is not embedded", name);
    return file->text;
}

}  // namespace darb
