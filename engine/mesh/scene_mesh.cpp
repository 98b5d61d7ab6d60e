// SPDX-License-Identifier: MIT
#include "engine/mesh/scene_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <span>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/quantile.h"
#include "engine/core/text.h"
#include "engine/data/camera_list.h"
#include "engine/mesh/mesh_file.h"
#include "engine/mesh/opacity.h"
#include "engine/mesh/texture.h"
#include "engine/raster/frame_view.h"
#include "engine/render/renderer.h"
#include "engine/scene/subject.h"

namespace darb {

namespace {

constexpr double kIslandExtent = 10;  // voxels
constexpr double kOnSurface = 2;      // voxels: what a view shows there
constexpr double kFarOff = 1000;      // voxels: no reference of this scene
constexpr double kLeftOut = 20;       // thresholds, the least one: not part of the mean distance

void tell_progress(const MeshProgress& progress, const char* what, double share = 0) {
    if (progress) progress(what, share);
}

/// What the views see of the scene.
struct Sight {
    std::vector<DepthView> views;  // with the depths that were confirmed
    DepthViewOptions options;
    std::unique_ptr<Renderer> renderer;  // for the method `opacity`; else what it holds is gone
};

Sight look_at_scene(Device& device, SplatModel model, std::vector<View> views,
                    const SceneMeshOptions& options, const MeshProgress& progress,
                    SceneMeshReport& report) {
    for (View& view : views) {
        const Camera& c = view.camera;
        view.camera.lens = {};
        view.camera.shutter = {};
        view.lens = {"PINHOLE", {c.fx, c.fy, c.cx, c.cy}, c.width, c.height};
    }
    EffectPlan plan =
        plan_rendering(model, views, {.near_plane = options.near_plane}, options.effects);
    apply_plan(plan, model);
    ProjectionEffects effects = plan.projection();
    effects.off_centre = true;  // a surface lies where the camera says, not where it nearly does
    for (const View& view : views)
        check_frame(device, view.camera.width, view.camera.height, view.name);
    Sight sight;
    sight.options = {options.reading, options.level, options.near_plane,
                     options.texture != MeshTexturing::none};
    sight.renderer =
        std::make_unique<Renderer>(device, model, Accuracy{}, effects, plan.huge_splat_path());
    sight.views = render_depth_views(*sight.renderer, cameras_of(views), sight.options, progress);
    if (options.method == MeshMethod::tsdf) sight.renderer.reset();
    report.views = sight.views.size();
    report.depths = keep_confirmed(device, sight.views, model.origin, progress);
    return sight;
}

TriangleMesh surface_of(Device& device, Sight& sight, const glm::dvec3& origin, TsdfOptions options,
                        TsdfReport& report, const MeshProgress& progress) {
    if (!sight.renderer) return fuse_depths(device, sight.views, origin, options, report, progress);
    if (device.memory_budget() > 0)
        options.working_bytes -= std::min(options.working_bytes / 2, device.allocated_bytes());
    OpacityField field(*sight.renderer, sight.views, origin, sight.options,
                       options.working_bytes / 4);
    options.working_bytes -= options.working_bytes / 4;
    TriangleMesh mesh =
        opacity_surface(device, field, sight.views, origin, options, report, progress);
    sight.renderer.reset();
    return mesh;
}

/// Where a view has the point: its pixel, its depth and that of the surface there, 0 for none.
struct Seen {
    double z, surface;
};
std::optional<Seen> seen_in(const DepthView& view, const glm::dvec3& world) {
    const Camera& c = view.camera;
    const glm::dvec3 q = c.rotation * world + c.translation;
    const double x = c.fx * q.x / q.z + c.cx, y = c.fy * q.y / q.z + c.cy;
    if (!(q.z > 0) || x < 0 || y < 0 || x >= c.width || y >= c.height) return std::nullopt;
    return Seen{q.z, view.depth[std::size_t(y) * std::size_t(c.width) + std::size_t(x)]};
}

/// Whether some camera sees what is behind the point: there is no surface there.
bool is_looked_through(const std::vector<DepthView>& views, const glm::dvec3& p, double slack) {
    return std::any_of(views.begin(), views.end(), [&](const DepthView& view) {
        const auto seen = seen_in(view, p);
        return seen && seen->surface > seen->z + slack;
    });
}

/// Whether two cameras have the point in their pictures and nothing before it.
bool is_seen_by_two(const std::vector<DepthView>& views, const glm::dvec3& p, double slack) {
    int count = 0;
    for (const DepthView& view : views) {
        const auto seen = seen_in(view, p);
        if (!seen || (seen->surface > 0 && seen->z > seen->surface + slack)) continue;
        if (++count == 2) return true;
    }
    return false;
}

glm::dvec3 origin_of(const TriangleMesh& mesh) {
    return {mesh.origin[0], mesh.origin[1], mesh.origin[2]};
}

void clean(const SceneMeshOptions& options, SceneMesh& result, const MeshProgress& progress) {
    tell_progress(progress, "cleaning");
    SceneMeshReport& report = result.report;
    const double voxel = report.tsdf.voxel;
    const glm::dvec3 origin = origin_of(result.mesh);
    CleanOptions cleaning;
    cleaning.keep = options.keep;
    cleaning.min_faces = options.min_island;
    cleaning.min_extent = options.min_island > 0 ? kIslandExtent * voxel : 0;
    cleaning.longest_rim = options.fill_holes;
    cleaning.may_fill = [&](std::span<const std::array<glm::vec3, 3>> triangles) {
        return std::none_of(triangles.begin(), triangles.end(), [&](const auto& t) {
            const glm::dvec3 middle = glm::dvec3(t[0] + t[1] + t[2]) / 3.0 + origin;
            return is_looked_through(result.views, middle, 2 * voxel);
        });
    };
    report.clean = clean_mesh(result.mesh, cleaning);
    if (result.mesh.face.empty())
        throw Error(
            "mesh", "nothing is left of the surface after cleaning",
            "Use a smaller --voxel, --min-island 0, or cameras that see more of the scene.");
    if (options.faces > 0 && options.faces < result.mesh.face_count()) {
        tell_progress(progress, "simplification");
        Simplified simplified = simplify_mesh(result.mesh, options.faces);
        result.mesh = std::move(simplified.mesh);
        report.simplified_by = simplified.largest_distance;
    }
    set_normals(result.mesh);
}

// Pages.

constexpr int kGutter = 4;  // px

std::string without_ending(const std::string& name) {
    return name.substr(0, name.find_last_of('.'));
}

const View* photo_of(const MeshPhotos& photos, const std::string& name) {
    for (const View& view : photos.views)
        if (view.name == name) return &view;
    for (const View& view : photos.views)
        if (without_ending(view.name) == without_ending(name)) return &view;
    return nullptr;
}

/// The pose that the surface was seen from, with the pixels of the photo.
Camera at_size_of(Camera camera, const Camera& photo) {
    const double x = double(photo.width) / camera.width, y = double(photo.height) / camera.height;
    camera.fx *= x;
    camera.cx *= x;
    camera.fy *= y;
    camera.cy *= y;
    camera.width = photo.width;
    camera.height = photo.height;
    camera.lens = {};
    camera.shutter = {};
    return camera;
}

/// What the photo would show without its exposure; opaque.
ImageU8 unexposed(const ImageU8& photo, const std::array<float, 12>* map) {
    ImageU8 result(photo.width, photo.height, 3);
    glm::dmat3 linear(1.0);
    glm::dvec3 added(0.0);
    if (map) {
        for (int r = 0; r < 3; ++r) {
            for (int c = 0; c < 3; ++c) linear[c][r] = (*map)[std::size_t(4 * r + c)];
            added[r] = (*map)[std::size_t(4 * r + 3)];
        }
        if (!(std::abs(glm::determinant(linear)) > 1e-6)) map = nullptr;
    }
    const glm::dmat3 back = map ? glm::inverse(linear) : glm::dmat3(1.0);
    for (int y = 0; y < photo.height; ++y)
        for (int x = 0; x < photo.width; ++x) {
            glm::dvec3 colour(photo.at(x, y, 0), photo.at(x, y, 1), photo.at(x, y, 2));
            if (map) colour = 255.0 * (back * (colour / 255.0 - added));
            for (int c = 0; c < 3; ++c)
                result.at(x, y, c) =
                    static_cast<std::uint8_t>(std::clamp(colour[c], 0.0, 255.0) + 0.5);
        }
    return result;
}

class PhotoPainting {
  public:
    PhotoPainting(const SceneMesh& mesh, const std::vector<std::string>& names,
                  const MeshPhotos& photos, const MeshProgress& progress)
        : progress_(progress) {
        for (std::size_t v = 0; v < mesh.views.size(); ++v) {
            const View* const photo = photo_of(photos, names[v]);
            if (!photo) continue;
            shown_.push_back(photo);
            seen_.push_back(&mesh.views[v]);
            views_.cameras.push_back(at_size_of(mesh.views[v].camera, photo->camera));
            const auto map = photos.exposures.find(photo->name);
            exposure_.push_back(map == photos.exposures.end() ? nullptr : &map->second);
        }
        if (shown_.empty())
            throw Error("--texture photos", "no photo has the name of one of the cameras",
                        "Name the data set of the photos that the scene was trained on "
                        "(--cameras).");
        const double slack =
            kOnSurface * mesh.report.tsdf.voxel + mesh.report.simplified_by.value_or(0);
        views_.sees = [this, slack](std::size_t view, const glm::dvec3& point) {
            const auto seen = seen_in(*seen_[view], point);
            return seen && seen->surface > 0 && std::abs(seen->surface - seen->z) <= slack;
        };
        views_.photo = [this](std::size_t view) {
            tell_progress(progress_, "photos", double(view) / double(shown_.size()));
            return unexposed(load_photo(*shown_[view]), exposure_[view]);
        };
    }
    const PhotoViews& views() const { return views_; }

  private:
    const MeshProgress& progress_;
    std::vector<const View*> shown_;
    std::vector<const DepthView*> seen_;
    std::vector<const std::array<float, 12>*> exposure_;
    PhotoViews views_;
};

void paint(Device& device, const SceneMeshOptions& options, const std::vector<std::string>& names,
           const MeshPhotos* photos, const MeshProgress& progress, SceneMesh& result) {
    SceneMeshReport& report = result.report;
    TriangleMesh& mesh = result.mesh;
    report.texture =
        TextureReport{.texel = options.texel > 0 ? options.texel : report.tsdf.voxel / 2};
    tell_progress(progress, "charts");
    MeshTexture texture = unwrap_mesh(mesh, {.texel = report.texture->texel, .gutter = kGutter});
    if (photos) {
        const PhotoPainting painting(result, names, *photos, progress);
        tell_progress(progress, "choice of photos");
        const PhotoChoice choice = choose_photos(mesh, painting.views());
        SeamLevels levels;
        if (options.level_seams) levels = level_seams(mesh, painting.views(), choice);
        paint_with_photos(mesh, painting.views(), choice, levels, kGutter, texture);
        report.texture->unseen_faces = choice.unseen;
        report.texture->seams = choice.seams;
        if (options.level_seams) report.texture->seam_levels = {levels.before, levels.after};
    } else {
        paint_texture(
            mesh,
            [&](std::span<const SurfacePoint> points, std::span<glm::u8vec3> colours) {
                std::vector<glm::vec3> at;
                for (const SurfacePoint& point : points) at.push_back(point.position);
                std::ranges::copy(
                    colours_at(device, result.views, origin_of(mesh), at,
                               report.tsdf.voxel + report.simplified_by.value_or(0) / 2,
                               options.tsdf.working_bytes, progress),
                    colours.begin());
            },
            kGutter, texture);
    }
    report.texture->pages = texture.image.size();
    mesh.colour.clear();  // some programs would multiply them with the pages
    result.texture = std::move(texture);
}

}  // namespace

std::optional<MeshTexturing> mesh_texturing_from_name(std::string_view name) {
    for (std::size_t i = 0; i < std::size(kMeshTexturings); ++i)
        if (name == kMeshTexturings[i]) return static_cast<MeshTexturing>(i);
    return std::nullopt;
}

std::optional<MeshMethod> mesh_method_from_name(std::string_view name) {
    for (std::size_t i = 0; i < std::size(kMeshMethods); ++i)
        if (name == kMeshMethods[i]) return static_cast<MeshMethod>(i);
    return std::nullopt;
}

std::vector<View> mesh_views_around(const SplatModel& model) {
    constexpr int kViews = 32, kWidth = 960, kHeight = 720;
    std::vector<View> views;
    for (const Camera& camera : orbit_cameras(model, kViews, kWidth, kHeight)) {
        View view;
        view.name = fmt::format("around_{:02}", views.size());
        view.camera = camera;
        views.push_back(view);
    }
    return views;
}

SceneMesh mesh_scene(Device& device, SplatModel model, std::vector<View> views,
                     const SceneMeshOptions& options, const MeshPhotos* photos,
                     const MeshProgress& progress) {
    DARB_CHECK((photos != nullptr) == (options.texture == MeshTexturing::photos), "{}",
               static_cast<int>(options.texture));
    if (options.method == MeshMethod::opacity && options.reading == DepthReading::expected)
        throw Error("--depth expected",
                    "is a mean of depths, and says of no point what is before it",
                    "Use --depth front, solid or plane with --method opacity.");
    SceneMesh result;
    std::vector<std::string> names;
    for (const View& view : views) names.push_back(view.name);
    const glm::dvec3 origin = model.origin;
    SceneMeshReport& report = result.report;
    Sight sight =
        look_at_scene(device, std::move(model), std::move(views), options, progress, report);
    result.mesh = surface_of(device, sight, origin, options.tsdf, report.tsdf, progress);
    result.views = std::move(sight.views);
    report.raw_faces = result.mesh.face_count();
    TsdfOptions used = options.tsdf;
    used.voxel = report.tsdf.voxel;
    used.farthest = report.tsdf.farthest;
    if (options.method == MeshMethod::tsdf)
        report.thin_share = share_of_thin_blocks(result.views, result.mesh, used);
    clean(options, result, progress);
    // Texels of photos that nobody sees take the colours of vertices.
    if (options.texture == MeshTexturing::vertex || options.texture == MeshTexturing::photos)
        bake_colours(device, result.views, result.mesh,
                     report.tsdf.voxel + report.simplified_by.value_or(0) / 2,
                     options.tsdf.working_bytes, progress);
    if (has_pages(options.texture)) paint(device, options, names, photos, progress, result);
    return result;
}

ReferenceComparison compare_with_reference(const SceneMesh& mesh, const ReferenceOptions& options) {
    const double voxel = mesh.report.tsdf.voxel;
    CompareOptions comparing;
    comparing.spacing = voxel / 2;
    comparing.thresholds = options.thresholds;
    if (comparing.thresholds.empty()) comparing.thresholds = {voxel, 2 * voxel, 4 * voxel};
    comparing.left_out = kLeftOut * *std::ranges::min_element(comparing.thresholds);
    comparing.far_off = kFarOff * voxel;
    comparing.counts = [&](const glm::dvec3& p) {
        return is_seen_by_two(mesh.views, p, 4 * voxel);
    };
    const std::string where = options.path.string();
    ReferenceComparison result;
    if (has_extension(options.path, ".json")) {
        if (options.align)
            throw Error(where, "exact shapes are in the frame of their scene, and stay there",
                        "Leave --align out, or name a mesh or points.");
        result.comparison =
            compare_with_shapes(mesh.mesh, read_shapes(options.path), comparing, where);
        return result;
    }
    TriangleMesh reference = read_mesh(options.path, &result.notes);
    if (options.align && reference.vertex_count() > 0) {
        result.alignment = align_to_mesh(mesh.mesh, reference, *options.align, 2 * voxel);
        reference = moved_mesh(*result.alignment, std::move(reference));
    }
    result.comparison = compare_meshes(mesh.mesh, reference, comparing, where);
    return result;
}

// Colliders.

namespace {

constexpr double kTail = 0.02, kMargin = 0.05;  // of the splats at each end; of the extent
constexpr float kFaint = -2.2f;                 // logit of 0.1
constexpr double kCells = 256;                  // along the longest side

/// Low and high corner along the axes.
struct AxisBox {
    glm::dvec3 low{std::numeric_limits<double>::infinity()};
    glm::dvec3 high{-std::numeric_limits<double>::infinity()};
    void add(const glm::dvec3& p) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
};

/// Where all but the outermost of the splats are that are not faint.
AxisBox box_of_splats(const SplatModel& model, const glm::dmat3& axes) {
    std::vector<double> values[3];
    const auto add = [&](std::size_t i) {
        const float* p = &model.position[3 * i];
        const glm::dvec3 at = glm::transpose(axes) * glm::dvec3(p[0], p[1], p[2]);
        for (int axis = 0; axis < 3; ++axis) values[axis].push_back(at[axis]);
    };
    for (std::size_t i = 0; i < model.size(); ++i)
        if (model.opacity_logit[i] >= kFaint) add(i);
    if (values[0].empty())
        for (std::size_t i = 0; i < model.size(); ++i) add(i);
    AxisBox box;
    for (int axis = 0; axis < 3; ++axis) {
        box.low[axis] = nearest_rank(values[axis], kTail);
        box.high[axis] = nearest_rank(values[axis], 1 - kTail);
    }
    const glm::dvec3 extent = box.high - box.low;
    const double margin = kMargin * std::max({extent.x, extent.y, extent.z});
    box.low -= margin;
    box.high += margin;
    return box;
}

AxisBox box_for(const SplatModel& model, const std::vector<glm::dvec3>& cameras,
                const SceneColliderOptions& options, const glm::dmat3& axes) {
    AxisBox box;
    if (options.bounds) {
        for (int corner = 0; corner < 8; ++corner) {
            glm::dvec3 p;
            for (int axis = 0; axis < 3; ++axis)
                p[axis] =
                    corner >> axis & 1 ? options.bounds->high[axis] : options.bounds->low[axis];
            box.add(glm::transpose(axes) * p);
        }
        return box;
    }
    box = box_of_splats(model, axes);
    if (options.collider.kind == ColliderKind::object) return box;
    // Who walks from a camera needs room around it.
    for (const glm::dvec3& camera : cameras) {
        const glm::dvec3 at = glm::transpose(axes) * camera;
        box.add(at - glm::dvec3(2 * options.collider.radius));
        box.add(at + glm::dvec3(2 * options.collider.radius));
    }
    return box;
}

}  // namespace

SceneCollider collide_scene(const SplatModel& model, const std::vector<Camera>& cameras,
                            const SceneColliderOptions& options, const MeshProgress& progress) {
    if (model.size() == 0)
        throw Error("collider", "the scene has no splats", "Take one that has some.");
    std::vector<glm::dvec3> centres;
    for (const Camera& camera : cameras) centres.push_back(camera.centre() - model.origin);
    const glm::dmat3 axes = upright_axes(options.up);
    const AxisBox box = box_for(model, centres, options, axes);
    const glm::dvec3 extent = box.high - box.low;
    SceneCollider result;
    result.cell =
        options.cell > 0 ? options.cell : std::max({extent.x, extent.y, extent.z, 1e-6}) / kCells;
    VoxelGrid grid = make_grid(axes, box.low, box.high, result.cell);
    result.cells = grid.size;
    tell_progress(progress, "cells");
    fill_grid(model, grid);
    tell_progress(progress, "collider", 0.5);
    result.mesh = make_collider(grid, centres, options.collider);
    result.mesh.origin = {model.origin.x, model.origin.y, model.origin.z};
    return result;
}

}  // namespace darb
