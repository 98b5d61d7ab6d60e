// What `darb info` prints without --json: a line a fact.
#pragma once

#include <nlohmann/json.hpp>

namespace darb {

/// info: of scene_info.
void print_scene_info(const nlohmann::json& info);
/// info: of dataset_info.
void print_dataset_info(const nlohmann::json& info);

}  // namespace darb
