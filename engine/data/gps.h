// SPDX-License-Identifier: MIT
// Where photos were taken, by the GPS in their EXIF or in the XMP of a drone, and what that says of
// a scene: how long its unit is, which way north is, and where it lies on earth.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <span>

#include "engine/data/dataset.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// WGS 84. Degrees, north and east positive; metres.
struct GeoPosition {
    double latitude = 0, longitude = 0, altitude = 0;
};

/// The position in the EXIF of a JPEG (Exif 2.3, the GPS directory); nothing where it is missing,
/// damaged, or has no altitude. Never reads outside `file`, which may be just its beginning.
std::optional<GeoPosition> exif_position(std::span<const std::byte> file);

/// The position in the XMP of a photo by a DJI drone: GpsLatitude, GpsLongitude (in some firmware
/// GpsLongtitude) and AbsoluteAltitude, or else RelativeAltitude, which is above the place of the
/// start. Attributes or elements with the prefix drone-dji. Nothing where one of the three is
/// missing or no number, or where both angles are 0. `file` may be just its beginning.
std::optional<GeoPosition> drone_position(std::span<const std::byte> file);

/// Metres to the east, to the north and up of `origin`, in the plane that touches the earth there.
glm::dvec3 east_north_up(const GeoPosition& position, const GeoPosition& origin);

/// What positions say of a scene, and how far to trust it.
struct FoundPlace {
    EarthPlace place;
    double metres_per_unit = 0;
    double off = 0;        // median distance between cameras and their positions, metres
    double reach = 0;      // median distance of the positions from their middle, metres
    std::size_t used = 0;  // positions that fit within three times `off`
};

/// The similarity that takes camera centres to where they were, robust against single positions
/// that are wrong. Nothing for fewer than 4, or where all lie on one line, about which the scene
/// could turn. Throws Error where there are not as many positions as centres.
std::optional<FoundPlace> place_by_positions(std::span<const glm::dvec3> centres,
                                             std::span<const GeoPosition> positions);

/// Reads the positions of the photos, that of a drone where there is none in the EXIF, and sets
/// Dataset::place and, where depths have not set it, Dataset::metres_per_unit, with a note. A note
/// also says where positions do not determine these, or are too coarse: where `off` is more than a
/// fifth of `reach`, and where EXIF and drone lie more than 10 m apart on the ground; then the EXIF
/// counts. Fewer than 4 change nothing.
void find_place(Dataset& dataset);

}  // namespace darb
