// SPDX-License-Identifier: MIT
// darb mesh SCENE -o FILE: a surface out of the splats, as a triangle mesh.
#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/say.h"
#include "engine/core/system.h"
#include "engine/core/text.h"
#include "engine/data/camera_list.h"
#include "engine/gpu/device.h"
#include "engine/mesh/clean.h"
#include "engine/mesh/compare.h"
#include "engine/mesh/mesh_file.h"
#include "engine/mesh/opacity.h"
#include "engine/mesh/tsdf.h"
#include "engine/plan/effect_plan.h"
#include "engine/scene/subject.h"
#include "tools/darb/command_list.h"
#include "tools/darb/flags.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/outputs.h"
#include "tools/darb/tune_flags.h"
#include "trainer/job/scene_file.h"
#include "trainer/options/memory_size.h"

namespace darb {

namespace {

constexpr int kOrbitViews = 32, kOrbitWidth = 960, kOrbitHeight = 720;
constexpr double kIslandExtent = 10;    // voxels
constexpr double kFarOff = 1000;        // voxels: no reference of this scene
constexpr double kLeftOut = 20;         // thresholds, the least one: not part of the mean distance
constexpr double kWorkingShare = 0.85;  // of --max-memory for a range of blocks

struct MeshFlags {
    std::filesystem::path scene, cameras, output, json, reference;
    std::vector<double> thresholds;  // world units; none: 1, 2 and 4 voxels
    std::string method = "tsdf", reading = "front", bounds, max_memory, texture = "vertex", device;
    std::string effects = "auto";
    float level = 0.5f, near_plane = static_cast<float>(NEAR_DEFAULT);
    double fill_holes = 0;
    std::size_t faces = 0, keep = 0, min_island = 50;
    bool force = false, quiet = false;
    TsdfOptions tsdf;
    DatasetOptions data;
    KernelFlags kernel;
    StoredUnits units;
    TuneFlags tune;
};

/// Thrown by the progress of the work once a signal asked it to end; no Error, as nothing is wrong.
struct MeshStopped {};

/// What the work found, for the report.
struct MeshReport {
    ConfirmedDepths depths;
    TsdfReport tsdf;
    CleanReport clean;
    std::optional<double> simplified_by;  // largest distance of the full mesh, world units
    std::size_t views = 0, raw_faces = 0;
    std::optional<MeshComparison> comparison;
};

WorldBox box_from(const std::string& text, const glm::dvec3& origin) {
    const std::vector<double> numbers = numbers_from("--bounds", text, 6);
    const glm::dvec3 low(numbers[0], numbers[1], numbers[2]);
    const glm::dvec3 high(numbers[3], numbers[4], numbers[5]);
    if (!glm::all(glm::lessThan(low, high)))
        throw Error("--bounds " + text, "hold nothing: a least number is not below its largest",
                    "Give the least x, y, z and then the largest, as --bounds -1,-1,-1,1,1,1.");
    return {low - origin, high - origin};
}

std::uint64_t budget_from(const std::string& text) {
    const std::optional<double> bytes = parse_bytes(text);
    if (!bytes || !(*bytes >= 1e6 && *bytes < 9e18))
        throw Error("--max-memory " + text, "is no size of 1 MB or more",
                    "Give it as 800MB or 1.5GB.");
    return static_cast<std::uint64_t>(*bytes);
}

std::vector<View> chosen_views(const MeshFlags& flags, const SplatModel& model) {
    if (!flags.cameras.empty()) return open_cameras(flags.cameras, flags.data);
    std::vector<View> views = cameras_beside(flags.scene);
    if (!views.empty()) {
        say_note(fmt::format("cameras: the {} of the scene's run", views.size()));
        return views;
    }
    say_note(
        fmt::format("cameras: {} around the scene, as none are named; a room needs those of "
                    "its photos (--cameras)",
                    kOrbitViews));
    for (const Camera& camera : orbit_cameras(model, kOrbitViews, kOrbitWidth, kOrbitHeight)) {
        View view;
        view.name = fmt::format("around_{:02}", views.size());
        view.camera = camera;
        views.push_back(view);
    }
    return views;
}

/// What the views see of the scene.
struct Seen {
    std::vector<DepthView> views;
    DepthViewOptions options;
    std::unique_ptr<Renderer> renderer;  // for --method opacity; else what it holds is gone
};

/// Depths of all views, confirmed.
Seen seen_surfaces(Device& device, SplatModel model, std::vector<View> views,
                   const MeshFlags& flags, const EffectChoice& choice, const MeshProgress& progress,
                   MeshReport& report) {
    for (View& view : views) view.camera.lens = {};
    EffectPlan plan = plan_rendering(model, views, {.near_plane = flags.near_plane}, choice);
    apply_plan(plan, model);
    ProjectionEffects effects = plan.projection();
    effects.off_centre = true;  // a surface lies where the camera says, not where it nearly does
    for (const View& view : views)
        check_frame(device, view.camera.width, view.camera.height, view.name);
    Seen seen;
    seen.options = {*depth_reading_from_name(flags.reading), flags.level, flags.near_plane,
                    flags.texture == "vertex"};
    seen.renderer =
        std::make_unique<Renderer>(device, model, Accuracy{}, effects, plan.huge_splat_path());
    seen.views = render_depth_views(*seen.renderer, cameras_of(views), seen.options, progress);
    if (flags.method == "tsdf") seen.renderer.reset();
    report.views = seen.views.size();
    report.depths = keep_confirmed(device, seen.views, model.origin, progress);
    return seen;
}

TriangleMesh surface_of(Device& device, Seen& seen, const glm::dvec3& origin, TsdfOptions options,
                        TsdfReport& report, const MeshProgress& progress) {
    if (!seen.renderer) return fuse_depths(device, seen.views, origin, options, report, progress);
    if (device.memory_budget() > 0)
        options.working_bytes -= std::min(options.working_bytes / 2, device.allocated_bytes());
    OpacityField field(*seen.renderer, seen.views, origin, seen.options, options.working_bytes / 4);
    options.working_bytes -= options.working_bytes / 4;
    TriangleMesh mesh =
        opacity_surface(device, field, seen.views, origin, options, report, progress);
    seen.renderer.reset();
    return mesh;
}

/// Whether some camera sees what is behind the point: there is no surface there.
bool is_looked_through(const std::vector<DepthView>& views, const glm::dvec3& p, double slack) {
    for (const DepthView& view : views) {
        const Camera& c = view.camera;
        const glm::dvec3 q = c.rotation * p + c.translation;
        const double x = c.fx * q.x / q.z + c.cx, y = c.fy * q.y / q.z + c.cy;
        if (!(q.z > 0) || x < 0 || y < 0 || x >= c.width || y >= c.height) continue;
        if (view.depth[std::size_t(y) * c.width + std::size_t(x)] > q.z + slack) return true;
    }
    return false;
}

void clean(const MeshFlags& flags, const std::vector<DepthView>& views, const glm::dvec3& origin,
           TriangleMesh& mesh, MeshReport& report) {
    CleanOptions options;
    options.keep = flags.keep;
    options.min_faces = flags.min_island;
    options.min_extent = flags.min_island > 0 ? kIslandExtent * report.tsdf.voxel : 0;
    options.longest_rim = flags.fill_holes;
    options.may_fill = [&](std::span<const std::array<glm::vec3, 3>> triangles) {
        for (const auto& t : triangles) {
            const glm::dvec3 middle = glm::dvec3(t[0] + t[1] + t[2]) / 3.0 + origin;
            if (is_looked_through(views, middle, 2 * report.tsdf.voxel)) return false;
        }
        return true;
    };
    report.clean = clean_mesh(mesh, options);
    if (mesh.face.empty())
        throw Error(
            flags.output.string(), "nothing is left of the surface after cleaning",
            "Use a smaller --voxel, --min-island 0, or cameras that see more of the scene.");
    if (flags.faces > 0 && flags.faces < mesh.face_count()) {
        Simplified simplified = simplify_mesh(mesh, flags.faces);
        mesh = std::move(simplified.mesh);
        report.simplified_by = simplified.largest_distance;
    }
    set_normals(mesh);
}

/// Whether two cameras have the point in their pictures and nothing before it.
bool is_seen_by_two(const std::vector<DepthView>& views, const glm::dvec3& p, double slack) {
    int seen = 0;
    for (const DepthView& view : views) {
        const Camera& c = view.camera;
        const glm::dvec3 q = c.rotation * p + c.translation;
        const double x = c.fx * q.x / q.z + c.cx, y = c.fy * q.y / q.z + c.cy;
        if (!(q.z > 0) || x < 0 || y < 0 || x >= c.width || y >= c.height) continue;
        const double z = view.depth[std::size_t(y) * c.width + std::size_t(x)];
        if (z > 0 && q.z > z + slack) continue;
        if (++seen == 2) return true;
    }
    return false;
}

MeshComparison compare(const MeshFlags& flags, const std::vector<DepthView>& views, double voxel,
                       const TriangleMesh& mesh) {
    CompareOptions options;
    options.spacing = voxel / 2;
    options.thresholds = flags.thresholds;
    if (options.thresholds.empty()) options.thresholds = {voxel, 2 * voxel, 4 * voxel};
    options.left_out = kLeftOut * *std::ranges::min_element(options.thresholds);
    options.far_off = kFarOff * voxel;
    options.counts = [&](const glm::dvec3& p) { return is_seen_by_two(views, p, 4 * voxel); };
    const std::string where = flags.reference.string();
    if (has_extension(flags.reference, ".json"))
        return compare_with_shapes(mesh, read_shapes(flags.reference), options, where);
    std::vector<std::string> notes;
    const TriangleMesh reference = read_mesh(flags.reference, &notes);
    say_notes(notes);
    return compare_meshes(mesh, reference, options, where);
}

double share(std::size_t part, std::size_t whole) {
    return whole > 0 ? double(part) / double(whole) : 0;
}

nlohmann::json distances_json(const DistanceStatistics& d) {
    return {{"samples", d.samples},
            {"mean", d.mean},
            {"median", d.median},
            {"p90", d.p90},
            {"largest", d.largest}};
}

nlohmann::json comparison_json(const MeshComparison& c) {
    nlohmann::json json{{"accuracy", distances_json(c.accuracy)}};
    if (std::isfinite(c.bias)) json["bias"] = c.bias;
    if (std::isfinite(c.normal_degrees)) json["normal_degrees"] = c.normal_degrees;
    nlohmann::json& scores = json["f_scores"] = nlohmann::json::array();
    for (const FScore& f : c.f_scores)
        scores.push_back({{"threshold", f.threshold}, {"precision", f.precision}});
    if (c.completeness.samples == 0) return json;  // shapes, which have no samples
    for (std::size_t i = 0; i < scores.size(); ++i) {
        scores[i]["recall"] = c.f_scores[i].recall;
        scores[i]["f"] = c.f_scores[i].f();
    }
    json["completeness"] = distances_json(c.completeness);
    json["chamfer"] = c.chamfer;
    json["left_out_share"] = c.left_out_share;
    return json;
}

void tell_comparison(std::FILE* out, const MeshComparison& c) {
    const auto row = [&](const char* name, const char* what, const DistanceStatistics& d) {
        tell(out, "{:<13} {:<18}  mean {:.4g}  median {:.4g}  90 % {:.4g}", name, what, d.mean,
             d.median, d.p90);
    };
    row("accuracy", "mesh to reference", c.accuracy);
    tell(out, "{}\n", std::isfinite(c.bias) ? fmt::format("  bias {:+.4g}", c.bias) : "");
    if (c.completeness.samples > 0) {
        row("completeness", "reference to mesh", c.completeness);
        tell(out, "  Chamfer {:.4g} ({:.1f} % left out)\n", c.chamfer, 100 * c.left_out_share);
    }
    if (std::isfinite(c.normal_degrees))
        tell(out, "normals off by {:.1f} degrees\n", c.normal_degrees);
    for (const FScore& f : c.f_scores) {
        tell(out, "within {:.4g}: precision {:.3f}", f.threshold, f.precision);
        if (c.completeness.samples > 0) tell(out, "  recall {:.3f}  F {:.3f}", f.recall, f.f());
        tell(out, "\n");
    }
}

nlohmann::json report_json(const MeshFlags& flags, const MeshReport& r, const TriangleMesh& mesh) {
    nlohmann::json json{{"output", name_in_json(flags.json, flags.output)},
                        {"vertices", mesh.vertex_count()},
                        {"faces", mesh.face_count()},
                        {"voxel", r.tsdf.voxel},
                        {"farthest", r.tsdf.farthest},
                        {"method", flags.method},
                        {"depth", flags.reading},
                        {"level", flags.level},
                        {"views", r.views},
                        {"surface_share", share(r.depths.surfaces, r.depths.pixels)},
                        {"confirmed_share", share(r.depths.kept, r.depths.surfaces)},
                        {"blocks", r.tsdf.blocks},
                        {"ranges", r.tsdf.ranges},
                        {"raw_faces", r.raw_faces},
                        {"parts", r.clean.parts - r.clean.parts_removed},
                        {"parts_removed", r.clean.parts_removed},
                        {"holes_filled", r.clean.holes_filled},
                        {"holes_left", r.clean.holes_left}};
    if (r.simplified_by) json["simplified_by"] = *r.simplified_by;
    if (r.comparison) json["comparison"] = comparison_json(*r.comparison);
    return json;
}

void tell_report(std::FILE* out, const MeshReport& r, const TriangleMesh& mesh) {
    tell(out,
         "{} views: {:.0f} % of the pixels show a surface, other views confirm {:.0f} % of "
         "those\n",
         r.views, 100 * share(r.depths.surfaces, r.depths.pixels),
         100 * share(r.depths.kept, r.depths.surfaces));
    tell(out, "voxel {:.4g}, {} blocks of {} voxels in {} range{}, depths up to {:.4g}\n",
         r.tsdf.voxel, r.tsdf.blocks, BLOCK_VOXELS, r.tsdf.ranges, r.tsdf.ranges == 1 ? "" : "s",
         r.tsdf.farthest);
    tell(out, "cleaned: {} of {} parts removed, {} holes filled\n", r.clean.parts_removed,
         r.clean.parts, r.clean.holes_filled);
    if (r.simplified_by)
        tell(out, "simplified: the full surface is at most {:.4g} away\n", *r.simplified_by);
    tell(out, "{} vertices, {} faces\n", mesh.vertex_count(), mesh.face_count());
    if (r.comparison) tell_comparison(out, *r.comparison);
}

TriangleMesh make_mesh(const MeshFlags& flags, const std::atomic<bool>& stop, MeshReport& report) {
    MeshFlags f = flags;
    const EffectChoice choice = choose_effects(f.effects, EffectUse::pictures, f.data);
    const SplatModel model = in_kernel(f.kernel, load_scene(f.scene, nullptr, f.units));
    if (model.size() == 0)
        throw Error(f.scene.string(), "the scene has no splats", "Mesh one that has some.");
    if (!f.bounds.empty()) f.tsdf.bounds = box_from(f.bounds, model.origin);
    const std::vector<View> views = chosen_views(f, model);
    Device device(command_device(f.device));
    settle_tuning(device, f.tune);
    if (!f.max_memory.empty()) {
        const std::uint64_t budget = budget_from(f.max_memory);
        device.set_memory_budget(budget);
        f.tsdf.working_bytes = static_cast<std::uint64_t>(kWorkingShare * double(budget));
    }
    std::string now;
    std::optional<SlowProgress> notes;
    const MeshProgress progress = [&](const char* what, double part) {
        if (stop) throw MeshStopped{};
        if (now != what) notes.emplace(now = what);
        notes->at(part);
    };
    Seen what = seen_surfaces(device, model, views, f, choice, progress, report);
    TriangleMesh mesh = surface_of(device, what, model.origin, f.tsdf, report.tsdf, progress);
    const std::vector<DepthView>& seen = what.views;
    report.raw_faces = mesh.face_count();
    clean(f, seen, model.origin, mesh, report);
    if (f.texture == "vertex")
        bake_colours(device, seen, mesh, report.tsdf.voxel, f.tsdf.working_bytes, progress);
    if (!f.reference.empty()) {
        progress("comparison", 0);
        report.comparison = compare(f, seen, report.tsdf.voxel, mesh);
    }
    progress("files", 0);
    return mesh;
}

int mesh(const MeshFlags& flags) {
    const Paths inputs =
        together({files_of(flags.scene), files_of(flags.cameras), Paths{flags.reference}});
    refuse_to_overwrite_inputs({flags.output, flags.json}, inputs, Replaces::all);
    const WrittenFiles written(files_of(flags.scene), flags.force);
    written.check({flags.output});
    if (mesh_endings().find(flags.output.extension().string()) == std::string::npos ||
        flags.output.extension().empty())
        throw Error(flags.output.string(), "has no ending of a mesh",
                    "Use " + mesh_endings() + ".");
    if (flags.method == "opacity" && flags.reading == "expected")
        throw Error("--depth expected",
                    "is a mean of depths, and says of no point what is before it",
                    "Use --depth front, solid or plane with --method opacity.");
    if (flags.faces > 0 && !can_simplify())
        throw Error("--faces", "this darb was built without meshoptimizer",
                    "Install libmeshoptimizer-dev and build it again, or leave --faces out.");
    const std::atomic<bool>& stop = stop_on_signals();
    MeshReport report;
    TriangleMesh result;
    try {
        result = make_mesh(flags, stop, report);
    } catch (const MeshStopped&) {
        say("stopped by {}: nothing was written\n", stop_name());
        return stop_exit_code();
    }
    const EncodedSplats encoded = encode_mesh(result, flags.output.string());
    const Paths outputs = outputs_of(flags.output, encoded);
    written.check(outputs);
    write_mesh(flags.output, result);
    written.wrote(outputs);
    write_json(flags.json, report_json(flags, report, result));
    tell_report(stream_beside_json(flags.json, flags.quiet), report, result);
    tell_paths(flags.quiet, together({outputs, {flags.json}}));
    return 0;
}

void add_surface_options(CLI::App& c, MeshFlags& flags) {
    c.add_option("--method", flags.method,
                 "tsdf: the mean of the views' distances; opacity: where the opacity of the space "
                 "passes 1 - level, which keeps thin things and takes longer")
        ->capture_default_str()
        ->check(CLI::IsMember({"tsdf", "opacity"}));
    c.add_option("--depth", flags.reading,
                 "how a splat takes light along a ray: front, solid, plane, or expected, the mean "
                 "of the centres")
        ->capture_default_str()
        ->check(CLI::IsMember(
            std::vector<std::string>(std::begin(kDepthReadings), std::end(kDepthReadings))));
    c.add_option("--level", flags.level, "share of the light that is left at the surface")
        ->capture_default_str()
        ->check(CLI::Range(0.01, 0.99));
    c.add_option("--voxel", flags.tsdf.voxel, "side of a voxel, world units")
        ->default_str("a pixel on the surface, in the median")
        ->check(above_zero());
    c.add_option("--truncation", flags.tsdf.truncation,
                 "half width of the band around a depth, voxels")
        ->capture_default_str()
        ->check(CLI::Range(2, 16));
    c.add_option("--far", flags.tsdf.farthest, "largest depth that counts, world units")
        ->default_str("4 times the median depth")
        ->check(above_zero());
    c.add_option("--near", flags.near_plane, "nearest distance drawn, world units")
        ->capture_default_str()
        ->check(above_zero());
    c.add_option("--bounds", flags.bounds, "X0,Y0,Z0,X1,Y1,Z1: a box that the mesh stays in")
        ->default_str("what two views see");
    c.add_option("--max-memory", flags.max_memory,
                 "budget of device memory, as 800MB or 1.5GB; the mesh has the same bits")
        ->default_str("none");
}

void add_cleaning_options(CLI::App& c, MeshFlags& flags) {
    c.add_option("--faces", flags.faces, "simplify to so many faces")
        ->default_str("off")
        ->check(CLI::Range(4, 2'000'000'000));
    c.add_option("--keep", flags.keep, "so many parts, the largest")->default_str("all");
    c.add_option("--min-island", flags.min_island,
                 "smallest part, faces; one of fewer, or of less than 10 voxels across, goes; 0: "
                 "all stay")
        ->capture_default_str();
    c.add_option("--fill-holes", flags.fill_holes,
                 "close holes with a shorter rim, world units, that no camera looks through")
        ->default_str("off")
        ->check(above_zero());
    c.add_option("--texture", flags.texture, "vertex: a colour at each vertex; none")
        ->capture_default_str()
        ->check(CLI::IsMember({"none", "vertex"}));
}

void add_reference_options(CLI::App& c, MeshFlags& flags) {
    CLI::Option* const reference = c.add_option(
        "--reference", flags.reference,
        "compare with this: a mesh or points (" + mesh_endings() + "), or a .json of exact shapes");
    c.add_option("--thresholds", flags.thresholds,
                 "distances of the F-score, world units, with commas")
        ->delimiter(',')
        ->check(above_zero())
        ->default_str("1, 2 and 4 voxels")
        ->needs(reference);
}

}  // namespace

void add_mesh(CLI::App& app, Action& action) {
    auto flags = std::make_shared<MeshFlags>();
    CLI::App* command =
        app.add_subcommand("mesh", "Make a triangle mesh of the surface that the splats show");
    command->add_option("scene", flags->scene, "splat file, or the output folder of darb train")
        ->required();
    command
        ->add_option("-o,--output", flags->output,
                     "the mesh; the ending says the format: " + mesh_endings())
        ->required();
    command->add_option("--cameras", flags->cameras,
                        "from where to look: a cameras.json, a transforms.json or a data set "
                        "[those of the scene's run; else 32 around it]");
    command->add_option("-r,--resolution", flags->data.resolution,
                        "of a data set's cameras: 1, 2, 4, 8 or a width in px");
    add_surface_options(*command, *flags);
    add_cleaning_options(*command, *flags);
    add_reference_options(*command, *flags);
    command->add_flag("--force", flags->force, "replace a file that darb did not write");
    add_json_option(*command, flags->json);
    add_kernel_flags(*command, flags->kernel, "draw with it in the place of the scene's own");
    add_effects_flag(*command, flags->effects);
    command->add_option("--device", flags->device, "number or part of a name, see `darb devices`");
    add_tune_flags(*command, flags->tune);
    add_quiet_flag(*command, flags->quiet);
    add_unit_options(*command, flags->units);
    command->callback([flags, &action] { action = [flags] { return mesh(*flags); }; });
}

}  // namespace darb
