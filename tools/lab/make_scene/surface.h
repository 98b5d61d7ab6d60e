// SPDX-License-Identifier: MIT
// What is true of a generated scene's surface, for measuring meshes: its shapes, and points on them
// that at least two training photos see.
#pragma once

#include <filesystem>
#include <vector>

#include "engine/mesh/compare.h"
#include "tools/lab/make_scene/capture.h"
#include "tools/lab/make_scene/world.h"

namespace darb::make_scene {

struct SurfaceSettings {
    double spacing = 0;  // one point for each square of this side, world units
    double floor = 0;    // radius of the floor around 0
};
/// Half of a photo's pixel on the objects; the floor up to where it fades into the sky.
constexpr SurfaceSettings kStillLifeSurface{.spacing = 0.007, .floor = 2.6};
/// The pixel of a photo from the flight; the floor as far as the town reaches.
constexpr SurfaceSettings kTownSurface{.spacing = 0.025, .floor = 15};

/// The scene's objects and its floor.
std::vector<PlacedShape> shapes_of(const World& world);

/// Points with normals, spread by chance (seed 0) and evenly by area over the surfaces of shapes
/// that at least two training views see. Uses all cores; the result does not depend on their
/// number.
TriangleMesh surface_points(const World& world, const std::vector<View>& views,
                            const SurfaceSettings& settings);

/// Writes FOLDER/surface.ply and FOLDER/shapes.json. Throws Error.
void write_surface(const std::filesystem::path& folder, const World& world,
                   const std::vector<View>& views, const SurfaceSettings& settings);

}  // namespace darb::make_scene
