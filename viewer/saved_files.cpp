#include "viewer/saved_files.h"

#include <utility>

#include "engine/core/error.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

// One name for a file, by whatever way it is named.
fs::path known_as(const fs::path& file) {
    std::error_code none;
    const fs::path whole = fs::weakly_canonical(fs::absolute(file), none);
    return none ? file : whole;
}

}  // namespace

void SavedFiles::check(const fs::path& file) {
    std::error_code none;
    const fs::file_type kind = fs::status(file, none).type();
    const fs::path before = std::exchange(asked_for_, known_as(file));
    if (kind == fs::file_type::not_found || ours_.contains(asked_for_)) return;
    if (kind != fs::file_type::regular)
        throw Error(file.string(), "is there, and is not a plain file", "Choose another name.");
    if (before == asked_for_) return;
    throw Error(file.string(), "is there already; nothing was written",
                "Choose another name, or save again to replace it.");
}

void SavedFiles::wrote(const fs::path& file) {
    ours_.insert(known_as(file));
    asked_for_.clear();
}

}  // namespace darb
