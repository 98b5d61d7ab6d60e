// SPDX-License-Identifier: MIT
// Writes the captured scene as a data set that darb and other common trainers can read.
#pragma once

#include <filesystem>

#include "tools/lab/make_scene/capture.h"

namespace darb::make_scene {

/// Writes FOLDER/images/NAME, sparse/0 (COLMAP, all views), test.txt (names of the held-out views,
/// one per line), transforms_train.json and transforms_test.json (OpenGL camera frame). Throws
/// Error.
void write_scene(const std::filesystem::path& folder, const std::vector<View>& views,
                 const Capture& capture);

/// Writes only FOLDER/images/NAME and transforms_test.json: a data set whose views are all held
/// out. Throws Error.
void write_test_views(const std::filesystem::path& folder, const std::vector<View>& views,
                      const std::vector<ImageU8>& photos);

/// Writes FOLDER/images/NAME and truth.json, a transforms.json with their true poses: a folder of
/// panoramas without cameras, for whoever finds them. Throws Error.
void write_panoramas(const std::filesystem::path& folder, const std::vector<View>& views,
                     const std::vector<ImageU8>& photos);

/// Writes FOLDER/depths: a 16-bit PNG per view, in millimetres.
void write_depths(const std::filesystem::path& folder, const std::vector<View>& views,
                  const std::vector<ImageF>& depths);

}  // namespace darb::make_scene
