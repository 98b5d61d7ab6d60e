// What `darb info` says of a splat scene.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "engine/scene/stored_units.h"

namespace darb {

/// Reads any splat file. Keys: path, format, version (null where the format has none), details,
/// bytes, splats, dropped, notes (of the reader), kernel, footprint, render_mode, sh_degree,
/// origin; bounds and inner_bounds (1st to 99th percentile by axis) {low, high}, world; scale (the
/// largest standard deviation of a splat, world), opacity and, of a kernel with shapes, exponent
/// (as drawn) {p1, p10, p50, p90, p99}; zero_rotations, huge, needles, saturated, invisible
/// (counts); warnings (sentences). Throws Error for other files. O(N).
nlohmann::json scene_info(const std::filesystem::path& path, const StoredUnits& units = {});

}  // namespace darb
