// Paths that a run writes into its folder: as seen from there, so that folder and data can move
// together and say nothing of the rest of the machine.
#pragma once

#include <filesystem>
#include <string>

namespace darb {

/// path as seen from `folder`, by the places that both come to; a link at the end of path stays a
/// link. `folder` itself is ".".
std::filesystem::path seen_from(const std::filesystem::path& folder,
                                const std::filesystem::path& path);

/// The same for people: only the last name where the two have no folder in common but the root.
std::string shared_name(const std::filesystem::path& folder, const std::filesystem::path& path);

/// text with `path`, as it is and as an absolute path, replaced by its last name wherever it
/// stands.
std::string without_folders(std::string text, const std::filesystem::path& path);

}  // namespace darb
