// What `darb info` says of photos with cameras.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "engine/data/dataset.h"

namespace darb {

/// Opens a data set (heads of the photos only) or a cameras.json. Keys: path, source, views, train,
/// test (as the source splits them), sizes [{width, height, views}] (px, as training takes them),
/// lenses [{model, width, height, views}] (as declared), points, extent (world units), has_alpha,
/// notes. Throws Error as load_dataset does.
nlohmann::json dataset_info(const std::filesystem::path& path, const DatasetOptions& options);

}  // namespace darb
