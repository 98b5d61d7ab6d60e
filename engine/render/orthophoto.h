// SPDX-License-Identifier: MIT
// Orthophotos: pictures without perspective, as maps and elevations are. A pixel is everywhere as
// large as any other, in world units.
//
// One is drawn in tiles, each by a pinhole so far away that its rays are parallel to within a tenth
// of a pixel over the whole depth of the scene. So every kernel, effect and pass works as in other
// pictures.
#pragma once

#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/scene/camera.h"
#include "engine/scene/splat_model.h"

namespace darb {

struct Orthophoto {
    glm::dmat3 axes{1.0};    // of the world into the picture: right, down and away from the viewer
    glm::dvec3 corner{0.0};  // the top left corner of the picture at its nearest depth, world
    double depth = 0;        // from there to the farthest depth, world units
    double pixel = 0;        // side of a pixel, world units
    int width = 0, height = 0;  // px
};

struct OrthophotoOptions {
    glm::dvec3 from{0, 0, 1};  // unit, world: the side that the viewer is on
    glm::dvec3 up{0, 0, 1};    // unit, world: what is up in the picture, unless it is along `from`
    glm::dvec3 north{0.0};     // what is up then; 0: y or, where that is along `from`, z
    double pixel = 0;          // side of a pixel, world units; 0: as `longest` says
    int longest = 2048;        // px of the longer side, where `pixel` is 0
};

/// The orthophoto that shows the dense part of the scene: all but 0.2 % of its splats at each end
/// of each axis, with a margin of 2 %. Nearer splats are not drawn, so that what hangs above a
/// scene does not hide it. Opacities below 0.1 do not count. Throws Error where there are no
/// splats, or the picture would have more than 32,768 px on a side.
Orthophoto orthophoto_of(const SplatModel& model, const OrthophotoOptions& options);

struct OrthophotoTile {
    Camera camera;
    float near_plane = 0;  // world units: where the picture's nearest depth is
    int x = 0, y = 0;      // px: where the tile's top left corner is in the picture
};
std::vector<OrthophotoTile> tiles_of(const Orthophoto& photo);

/// Draws all tiles and joins them; render: RGB.
using RenderTile = std::function<ImageU8(const OrthophotoTile&)>;
ImageU8 draw_orthophoto(const Orthophoto& photo, const RenderTile& render);

/// Where a world position p is on a map: scale * rotation * p + offset. By default the map is the
/// world itself.
struct MapFrame {
    double scale = 1;
    glm::dmat3 rotation{1.0};
    glm::dvec3 offset{0.0};
};
/// Metres east, north and up of the scene's anchor on earth, which must be known.
MapFrame map_of(const SplatModel& model);

/// The six lines of an ESRI world file (.pgw), which says where on a map the pixels are, where
/// right and down are axes of the map; otherwise nothing.
std::optional<std::string> world_file(const Orthophoto& photo, const MapFrame& map = {});

}  // namespace darb
