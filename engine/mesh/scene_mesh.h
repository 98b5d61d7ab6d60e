// SPDX-License-Identifier: MIT
// A mesh of a scene, from splats and cameras to what is written: depths, fusion, cleaning, colours
// or a texture, comparison with a reference; and a collider. What `darb mesh` and Scene.mesh of
// Python do.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/mesh/align.h"
#include "engine/mesh/clean.h"
#include "engine/mesh/collider.h"
#include "engine/mesh/compare.h"
#include "engine/mesh/depth_views.h"
#include "engine/mesh/tsdf.h"
#include "engine/plan/effect_plan.h"

namespace darb {

constexpr std::size_t kColliderFaces = 5000;

/// What a mesh looks like: nothing, colours at its vertices, or pages that are painted with the
/// scene's own pictures or with photos.
enum class MeshTexturing { none, vertex, splats, photos };
constexpr const char* kMeshTexturings[] = {"none", "vertex", "splats", "photos"};
std::optional<MeshTexturing> mesh_texturing_from_name(std::string_view name);
constexpr bool has_pages(MeshTexturing texturing) {
    return texturing == MeshTexturing::splats || texturing == MeshTexturing::photos;
}

/// tsdf: the mean of the views' distances. opacity: where the opacity of the space passes 1 -
/// level, which keeps thin things and takes longer.
enum class MeshMethod { tsdf, opacity };
constexpr const char* kMeshMethods[] = {"tsdf", "opacity"};
std::optional<MeshMethod> mesh_method_from_name(std::string_view name);

struct SceneMeshOptions {
    MeshMethod method = MeshMethod::tsdf;
    DepthReading reading = DepthReading::front;
    float level = 0.5f;  // share of the light that is left at the surface
    float near_plane = static_cast<float>(NEAR_DEFAULT);
    TsdfOptions tsdf;
    std::size_t faces = 0;  // simplify to so many; 0: off
    std::size_t keep = 0, min_island = 50;
    double fill_holes = 0;  // longest rim that is closed, world units; 0: off
    MeshTexturing texture = MeshTexturing::vertex;
    double texel = 0;         // side, world units; 0: half a voxel
    bool level_seams = true;  // between photos
    EffectChoice effects;
};

/// Photos to paint with. A view's photo is the one of the same name, else of the same name without
/// its ending.
struct MeshPhotos {
    std::vector<View> views;  // with their photos, at any size
    /// By name: row-major [3][4], picture to photo, as a run that learned exposures leaves them.
    std::map<std::string, std::array<float, 12>> exposures;
};

struct TextureReport {
    std::size_t pages = 0;
    double texel = 0;                         // world units
    std::size_t unseen_faces = 0, seams = 0;  // of photos
    // Mean difference of the photos along seams, 8-bit levels, before they were levelled and after.
    std::optional<std::array<double, 2>> seam_levels = std::nullopt;
};

struct SceneMeshReport {
    ConfirmedDepths depths;
    TsdfReport tsdf;
    CleanReport clean;
    std::optional<double> simplified_by;  // largest distance of the full mesh, world units
    std::size_t views = 0, raw_faces = 0;
    double thin_share = 0;  // of the blocks with a surface, see share_of_thin_blocks()
    std::optional<TextureReport> texture;
};

struct SceneMesh {
    TriangleMesh mesh;
    std::optional<MeshTexture> texture;
    std::vector<DepthView> views;  // with the depths that were confirmed
    SceneMeshReport report;
};

/// 32 cameras around a scene that has none of its own, 960x720 px.
std::vector<View> mesh_views_around(const SplatModel& model);

/// views: their cameras count, at their sizes, without lenses. photos: null unless the texture is
/// painted with them. Throws Error where no surface is seen, where nothing of it is left, and for
/// the opacity of a space by the reading `expected`, which tells none.
SceneMesh mesh_scene(Device& device, SplatModel model, std::vector<View> views,
                     const SceneMeshOptions& options, const MeshPhotos* photos = nullptr,
                     const MeshProgress& progress = {});

/// The share of the blocks in which depths show a surface that have depths from both of its sides,
/// and no part of the mesh within two voxels of them: front and back cancelled each other. mesh: as
/// fuse_depths made it.
double share_of_thin_blocks(const std::vector<DepthView>& views, const TriangleMesh& mesh,
                            const TsdfOptions& options);

struct ReferenceOptions {
    std::filesystem::path path;      // mesh, points, or a .json of shapes
    std::vector<double> thresholds;  // world units; none: 1, 2 and 4 voxels
    std::optional<AlignKind> align;
};
struct ReferenceComparison {
    MeshComparison comparison;
    std::optional<Alignment> alignment;
    std::vector<std::string> notes;  // of the reader
};
/// What two of the mesh's views see of both. Throws Error where the reference cannot be read, is
/// far off, or is to be aligned and holds shapes.
ReferenceComparison compare_with_reference(const SceneMesh& mesh, const ReferenceOptions& options);

struct SceneColliderOptions {
    ColliderOptions collider;
    double cell = 0;                      // world units; 0: 1/256 of the longest side of the box
    std::optional<WorldBox> bounds = {};  // relative to SplatModel::origin; else where splats are
    glm::dvec3 up{0, -1, 0};              // unit length
};
struct SceneCollider {
    TriangleMesh mesh;
    double cell = 0;  // world units
    glm::ivec3 cells{0};
};
/// From the splats alone, on the host. cameras: that must stand in what is free; none are needed
/// but for a room. Throws Error as make_collider does.
SceneCollider collide_scene(const SplatModel& model, const std::vector<Camera>& cameras,
                            const SceneColliderOptions& options, const MeshProgress& progress = {});

}  // namespace darb
