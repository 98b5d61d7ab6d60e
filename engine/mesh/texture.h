// SPDX-License-Identifier: MIT
// A texture for a mesh: flat charts on pages, painted by any source of colours or with photos, one
// a face. Source: Waechter et al. 2014, for the choice of photos (their data and smoothness terms)
// and the levelling of seams (their global step).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "engine/core/image.h"
#include "engine/mesh/triangle_mesh.h"
#include "engine/scene/camera.h"

namespace darb {

struct AtlasOptions {
    double texel = 0;      // side of a texel on the surface along an axis, world units; > 0
    int page_side = 4096;  // px, at most
    int gutter = 4;        // px around every chart
    std::size_t most_pages = 64;
};

/// Charts are connected faces whose normals have the same largest component, laid flat along that
/// axis; no two faces of a chart cover a texel. They stand on shelves, the highest first. The pages
/// are as large as they need to be, and black. Throws Error where a face is larger than a page, or
/// there would be too many pages.
MeshTexture unwrap_mesh(const TriangleMesh& mesh, const AtlasOptions& options);

/// The place of a texel's middle on the surface.
struct SurfacePoint {
    glm::vec3 position;  // in the mesh's frame
    glm::vec3 normal;    // unit length: interpolated, or the face's where the mesh has none
    std::uint32_t face = 0;
};
/// Gives each point a colour, sRGB. Called with many points at once.
using ColourSource =
    std::function<void(std::span<const SurfacePoint> points, std::span<glm::u8vec3> colours)>;

/// Paints every texel whose middle lies on a face, then `gutter` texels around them with their
/// neighbours' mean colours. A face without a texel of its own paints the one in its middle.
void paint_texture(const TriangleMesh& mesh, const ColourSource& source, int gutter,
                   MeshTexture& texture);

/// Photos as a source of colours.
struct PhotoViews {
    std::vector<Camera> cameras;  // without a lens: photos are as a pinhole takes them
    /// Whether a world point is what the view shows there, by its depth map.
    std::function<bool(std::size_t view, const glm::dvec3& point)> sees;
    /// The photo, 3 channels, of its camera's size, with its exposure undone.
    std::function<ImageU8(std::size_t view)> photo;
};

constexpr std::uint32_t kNoPhoto = std::numeric_limits<std::uint32_t>::max();

struct PhotoChoice {
    std::vector<std::uint32_t> view;  // [F]; kNoPhoto where none sees the face
    std::size_t unseen = 0;           // faces
    std::size_t seams = 0;            // edges between faces of different views
};
/// The photo of each face: that with the largest cos^2/z^2 of those that see its middle and have
/// its corners in the frame, against a third of `smoothing` for each neighbour with another photo.
/// Faces and then connected patches of one photo move to a cheaper one, in their order, until none
/// does: no cut of a graph, but the same bits on every machine.
PhotoChoice choose_photos(const TriangleMesh& mesh, const PhotoViews& views,
                          double smoothing = 3.0);

/// The colour that a photo shows at a point in the mesh's frame, between its pixels; nothing behind
/// the camera.
std::optional<glm::dvec3> photo_colour(const Camera& camera, const ImageU8& photo,
                                       const TriangleMesh& mesh, const glm::vec3& point);

/// What is added to the photos' colours so that they meet where one ends and the next begins:
/// smooth over the faces of a photo, in 8-bit levels of sRGB.
struct SeamLevels {
    std::vector<std::array<glm::vec3, 3>> added;  // [F] at the face's corners; empty: nothing
    double before = 0, after = 0;  // mean difference of the two photos along seams, levels
};
/// Least squares over all seams at once (Lempitsky and Ivanov 2007). Differences that are too large
/// to come from exposure count less. Reads each photo that has a seam once. Throws Error where the
/// choice is for another number of faces.
SeamLevels level_seams(const TriangleMesh& mesh, const PhotoViews& views,
                       const PhotoChoice& choice);

/// Paints each face with its photo and what is added to that, one photo after the other. Faces
/// without one get the colours of their vertices, or grey where the mesh has none.
void paint_with_photos(const TriangleMesh& mesh, const PhotoViews& views, const PhotoChoice& choice,
                       const SeamLevels& levels, int gutter, MeshTexture& texture);

}  // namespace darb
