// SPDX-License-Identifier: MIT
// darb mesh SCENE -o FILE: a surface out of the splats, as a triangle mesh, with colours or a
// texture; or a collider.
#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/count_text.h"
#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/json_text.h"
#include "engine/core/parse_number.h"
#include "engine/core/say.h"
#include "engine/core/system.h"
#include "engine/core/text.h"
#include "engine/data/camera_list.h"
#include "engine/gpu/device.h"
#include "engine/mesh/mesh_file.h"
#include "engine/mesh/scene_mesh.h"
#include "engine/mesh/topology.h"
#include "engine/scene/subject.h"
#include "tools/darb/command_list.h"
#include "tools/darb/flags.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/outputs.h"
#include "tools/darb/tune_flags.h"
#include "trainer/job/request.h"
#include "trainer/job/scene_file.h"
#include "trainer/options/memory_size.h"

namespace darb {

namespace {

constexpr double kWorkingShare = 0.85;  // of --max-memory for a range of blocks
constexpr double kManyThin = 0.01;      // of the blocks with a surface: worth a note

struct MeshFlags {
    std::filesystem::path scene, cameras, output, json, paper;
    std::string method = "tsdf", reading, bounds, max_memory, texture = "vertex", device;
    std::string seams = "level";
    std::string effects = "auto", collider, capsule, up, align;
    bool force = false, quiet = false;
    SceneMeshOptions mesh;
    ReferenceOptions reference;
    DatasetOptions data;
    KernelFlags kernel;
    StoredUnits units;
    TuneFlags tune;
};

/// Thrown by the progress of the work once a signal asked it to end; no Error, as nothing is wrong.
struct MeshStopped {};

/// What is written, and what is said of it.
struct MeshResult {
    TriangleMesh mesh;
    std::optional<MeshTexture> texture;
    nlohmann::json report;
    std::string text;      // for people
    Report paper{"", ""};  // the same as tables, where there is a reference
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

/// Those that are named, else those of the scene's run; none where it has none.
std::vector<View> known_views(const MeshFlags& flags) {
    if (!flags.cameras.empty()) return open_cameras(flags.cameras, flags.data);
    std::vector<View> views = cameras_beside(flags.scene);
    if (!views.empty()) say_note(fmt::format("cameras: the {} of the scene's run", views.size()));
    return views;
}

std::vector<View> chosen_views(const MeshFlags& flags, const SplatModel& model) {
    std::vector<View> views = known_views(flags);
    if (!views.empty()) return views;
    views = mesh_views_around(model);
    say_note(
        fmt::format("cameras: {} around the scene, as none are named; a room needs those of "
                    "its photos (--cameras)",
                    views.size()));
    return views;
}

// Photos.

/// The folder of the run that the scene is of; empty where there is none.
std::filesystem::path run_of(const MeshFlags& flags) {
    return log_of_run(flags.scene).parent_path();
}

/// The data set that is named, else the one that the scene's run was trained on; empty for none.
std::filesystem::path data_set_of(const MeshFlags& flags) {
    if (!flags.cameras.empty()) return flags.cameras;
    const std::filesystem::path run = run_of(flags);
    if (run.empty() || !std::filesystem::exists(run / kRequestFile)) return {};
    return read_request(run).dataset;
}

std::map<std::string, std::array<float, 12>> exposures_of(const std::filesystem::path& run) {
    const std::filesystem::path file = run / "exposure.json";
    std::map<std::string, std::array<float, 12>> maps;
    if (run.empty() || !std::filesystem::exists(file)) return maps;
    constexpr const char* kHint = "Train again, or remove the file.";
    const nlohmann::json all = parse_json_text(read_text_file(file), file.string(), kHint);
    try {
        for (const auto& [name, rows] : all.items()) {
            std::array<float, 12>& map = maps[name];
            for (std::size_t i = 0; i < map.size(); ++i)
                map[i] = rows.at(i / 4).at(i % 4).get<float>();
        }
    } catch (const nlohmann::json::exception& error) {
        throw Error(file.string(), json_reason(error), kHint);
    }
    return maps;
}

MeshPhotos photos_of(const MeshFlags& flags) {
    constexpr const char* kHint = "Name the data set of the scene's photos with --cameras.";
    const std::filesystem::path data_set = data_set_of(flags);
    if (data_set.empty())
        throw Error("--texture photos", "the scene is of no run that says where its photos are",
                    kHint);
    if (!std::filesystem::exists(data_set))
        throw Error(data_set.string(), "the photos that the scene was trained on are not there",
                    kHint);
    DatasetOptions options = flags.data;
    options.resolution = DatasetOptions{}.resolution;  // pages may be finer than depths
    MeshPhotos photos;
    photos.views = open_cameras(data_set, options);
    std::erase_if(photos.views, [](const View& view) {
        return view.photo.empty() || !std::filesystem::exists(view.photo);
    });
    if (photos.views.empty()) throw Error(data_set.string(), "has cameras without photos", kHint);
    photos.exposures = exposures_of(run_of(flags));
    return photos;
}

double share(std::size_t part, std::size_t whole) {
    return whole > 0 ? double(part) / double(whole) : 0;
}

// What is said of the result.

nlohmann::json distances_json(const DistanceStatistics& d) {
    return {{"samples", d.samples},
            {"mean", d.mean},
            {"median", d.median},
            {"p90", d.p90},
            {"largest", d.largest}};
}

nlohmann::json comparison_json(const MeshComparison& c) {
    nlohmann::json object{{"accuracy", distances_json(c.accuracy)}};
    if (std::isfinite(c.bias)) object["bias"] = c.bias;
    if (std::isfinite(c.normal_degrees)) object["normal_degrees"] = c.normal_degrees;
    nlohmann::json& scores = object["f_scores"] = nlohmann::json::array();
    for (const FScore& f : c.f_scores)
        scores.push_back({{"threshold", f.threshold}, {"precision", f.precision}});
    if (c.completeness.samples == 0) return object;  // shapes, which have no samples
    for (std::size_t i = 0; i < scores.size(); ++i) {
        scores[i]["recall"] = c.f_scores[i].recall;
        scores[i]["f"] = c.f_scores[i].f();
    }
    object["completeness"] = distances_json(c.completeness);
    object["chamfer"] = c.chamfer;
    object["left_out_share"] = c.left_out_share;
    return object;
}

std::string comparison_text(const MeshComparison& c) {
    const auto row = [](const char* name, const char* what, const DistanceStatistics& d) {
        return fmt::format("{:<13} {:<18}  mean {:.4g}  median {:.4g}  90 % {:.4g}", name, what,
                           d.mean, d.median, d.p90);
    };
    std::string text = row("accuracy", "mesh to reference", c.accuracy);
    if (std::isfinite(c.bias)) text += fmt::format("  bias {:+.4g}", c.bias);
    text += "\n";
    if (c.completeness.samples > 0)
        text += row("completeness", "reference to mesh", c.completeness) +
                fmt::format("  Chamfer {:.4g} ({:.1f} % left out)\n", c.chamfer,
                            100 * c.left_out_share);
    if (std::isfinite(c.normal_degrees))
        text += fmt::format("normals off by {:.1f} degrees\n", c.normal_degrees);
    for (const FScore& f : c.f_scores) {
        text += fmt::format("within {:.4g}: precision {:.3f}", f.threshold, f.precision);
        if (c.completeness.samples > 0)
            text += fmt::format("  recall {:.3f}  F {:.3f}", f.recall, f.f());
        text += "\n";
    }
    return text;
}

Report comparison_report(const MeshFlags& flags, const MeshComparison& c) {
    Report report("Mesh and reference", name_in_json(flags.paper, flags.output) + " against " +
                                            name_in_json(flags.paper, flags.reference.path));
    using Kind = TableColumn::Kind;
    const bool both = c.completeness.samples > 0;
    const auto known = [](double v) { return std::isfinite(v) ? TableCell(v) : TableCell(); };
    Table table{"distances",
                "Distances",
                both ? fmt::format("World units. {:.1f} % left out of the Chamfer distance.",
                                   100 * c.left_out_share)
                     : "World units.",
                {{"", "", Better::neither, 0, Kind::name}},
                {}};
    for (const char* name : {"mean", "median", "90 %", "largest", "bias", "Chamfer"})
        table.columns.push_back({name, "", Better::neither, 5});
    table.columns.push_back({"normals off by", "degrees", Better::neither, 1});
    table.rows.push_back(
        {{"accuracy, mesh to reference", c.accuracy.mean, c.accuracy.median, c.accuracy.p90,
          c.accuracy.largest, known(c.bias), TableCell(), known(c.normal_degrees)}});
    if (both)
        table.rows.push_back(
            {{"completeness, reference to mesh", c.completeness.mean, c.completeness.median,
              c.completeness.p90, c.completeness.largest, TableCell(), c.chamfer, TableCell()}});
    report.table(std::move(table));
    Table scores{
        "f scores", "Shares within a distance", "", {{"within", "", Better::neither, 5}}, {}};
    for (const char* name : {"precision", "recall", "F"})
        scores.columns.push_back({name, "", Better::neither, 3});
    for (const FScore& f : c.f_scores)
        scores.rows.push_back({{f.threshold, f.precision, both ? TableCell(f.recall) : TableCell(),
                                both ? TableCell(f.f()) : TableCell()}});
    report.table(std::move(scores));
    return report;
}

nlohmann::json alignment_json(const Alignment& a) {
    nlohmann::json rows = nlohmann::json::array();
    for (int r = 0; r < 3; ++r)
        rows.push_back({a.rotation[0][r], a.rotation[1][r], a.rotation[2][r]});
    return {
        {"scale", a.scale},     {"rotation", rows}, {"shift", {a.shift.x, a.shift.y, a.shift.z}},
        {"degrees", a.degrees}, {"moved", a.moved}, {"mean_before", a.before},
        {"mean_after", a.after}};
}

std::string alignment_text(const Alignment& a) {
    return fmt::format(
        "aligned: the reference was turned by {:.3g} degrees, moved by {:.4g} and scaled by "
        "{:.5g}; nine tenths of it lay {:.4g} from the mesh in the mean, and lie {:.4g} now\n",
        a.degrees, a.moved, a.scale, a.before, a.after);
}

nlohmann::json report_json(const MeshFlags& flags, const SceneMesh& result,
                           double metres_per_unit) {
    const SceneMeshReport& r = result.report;
    nlohmann::json object{{"output", name_in_json(flags.json, flags.output)},
                          {"vertices", result.mesh.vertex_count()},
                          {"faces", result.mesh.face_count()},
                          {"voxel", r.tsdf.voxel},
                          {"farthest", r.tsdf.farthest},
                          {"method", flags.method},
                          {"depth", kDepthReadings[static_cast<std::size_t>(flags.mesh.reading)]},
                          {"level", flags.mesh.level},
                          {"views", r.views},
                          {"surface_share", share(r.depths.surfaces, r.depths.pixels)},
                          {"confirmed_share", share(r.depths.kept, r.depths.surfaces)},
                          {"blocks", r.tsdf.blocks},
                          {"ranges", r.tsdf.ranges},
                          {"thin_share", r.thin_share},
                          {"raw_faces", r.raw_faces},
                          {"parts", r.clean.parts - r.clean.parts_removed},
                          {"parts_removed", r.clean.parts_removed},
                          {"holes_filled", r.clean.holes_filled},
                          {"holes_left", r.clean.holes_left}};
    if (metres_per_unit > 0) object["metres_per_unit"] = metres_per_unit;
    if (r.simplified_by) object["simplified_by"] = *r.simplified_by;
    if (r.texture) {
        object["texture"] = {
            {"of", flags.texture}, {"pages", r.texture->pages}, {"texel", r.texture->texel}};
        if (flags.mesh.texture == MeshTexturing::photos) {
            object["texture"]["unseen_faces"] = r.texture->unseen_faces;
            object["texture"]["seams"] = r.texture->seams;
            if (const auto& levels = r.texture->seam_levels)
                object["texture"]["seam_levels"] = {{"before", (*levels)[0]},
                                                    {"after", (*levels)[1]}};
        }
    }
    return object;
}

std::string report_text(const MeshFlags& flags, const SceneMesh& result, double metres_per_unit) {
    const SceneMeshReport& r = result.report;
    const auto length = [&](double units) {
        return metres_per_unit > 0
                   ? fmt::format("{:.4g} ({:.4g} m)", units, units * metres_per_unit)
                   : fmt::format("{:.4g}", units);
    };
    std::string text = fmt::format(
        "{} views: {:.0f} % of the pixels show a surface, other views confirm {:.0f} % of those\n"
        "voxel {}, {} blocks of {} voxels in {} range{}, depths up to {}\n"
        "cleaned: {} of {} parts removed, {} holes filled\n",
        r.views, 100 * share(r.depths.surfaces, r.depths.pixels),
        100 * share(r.depths.kept, r.depths.surfaces), length(r.tsdf.voxel), r.tsdf.blocks,
        BLOCK_VOXELS, r.tsdf.ranges, r.tsdf.ranges == 1 ? "" : "s", length(r.tsdf.farthest),
        r.clean.parts_removed, r.clean.parts, r.clean.holes_filled);
    if (r.simplified_by)
        text += fmt::format("simplified: the full surface is at most {} away\n",
                            length(*r.simplified_by));
    if (r.texture)
        text += fmt::format("texture: {} page{} with texels of {}", r.texture->pages,
                            r.texture->pages == 1 ? "" : "s", length(r.texture->texel));
    if (r.texture && flags.mesh.texture == MeshTexturing::photos)
        text += fmt::format("; {:.1f} % of the faces are in no photo and have the splats' colours",
                            100 * share(r.texture->unseen_faces, result.mesh.face_count()));
    if (r.texture) text += "\n";
    if (r.texture && r.texture->seam_levels)
        text += fmt::format(
            "seams: photos differ by {:.1f} of 255 levels there, by {:.1f} once levelled\n",
            (*r.texture->seam_levels)[0], (*r.texture->seam_levels)[1]);
    return text + fmt::format("{} vertices, {} faces\n", count_text(result.mesh.vertex_count()),
                              count_text(result.mesh.face_count()));
}

// The work.

SplatModel opened_scene(const MeshFlags& flags, SplatFile* facts = nullptr) {
    SplatModel model = in_kernel(flags.kernel, load_scene(flags.scene, facts, flags.units));
    if (model.size() == 0)
        throw Error(flags.scene.string(), "the scene has no splats", "Mesh one that has some.");
    return model;
}

/// Progress that ends the work once a signal asked for it, and notes what takes long.
MeshProgress stoppable_progress(const std::atomic<bool>& stop) {
    return [&stop, now = std::string(), notes = std::make_shared<std::optional<SlowProgress>>()](
               const char* what, double part) mutable {
        if (stop) throw MeshStopped{};
        if (now != what) notes->emplace(now = what);
        (*notes)->at(part);
    };
}

void note_faces_left(std::size_t faces, std::size_t asked) {
    constexpr double kNear = 1.05;
    if (asked == 0 || double(faces) <= kNear * double(asked)) return;
    say_note(fmt::format(
        "{} faces are left where {} were asked for: fewer would join parts or holes; leave out "
        "small parts (--min-island, --keep) or close holes (--fill-holes)",
        faces, asked));
}

void note_thin_parts(double thin_share) {
    if (thin_share < kManyThin) return;
    say_note(fmt::format(
        "{:.0f} % of the blocks with a surface lost it: seen from both sides, front and back "
        "cancel where something is thinner than two voxels; use a smaller --voxel, or "
        "--method opacity",
        100 * thin_share));
}

MeshResult make_surface(const MeshFlags& flags, const MeshProgress& progress) {
    MeshFlags f = flags;
    f.mesh.effects = choose_effects(f.effects, EffectUse::pictures, f.data);
    const SplatModel model = opened_scene(f);
    f.mesh.reading = depth_reading_from_name(f.reading).value_or(usual_reading(model.kernel));
    f.mesh.method = *mesh_method_from_name(f.method);
    if (!f.bounds.empty()) f.mesh.tsdf.bounds = box_from(f.bounds, model.origin);
    std::optional<MeshPhotos> photos;
    if (f.mesh.texture == MeshTexturing::photos) photos = photos_of(f);
    const std::vector<View> views = chosen_views(f, model);
    Device device(command_device(f.device));
    settle_tuning(device, f.tune);
    if (!f.max_memory.empty()) {
        const std::uint64_t budget = budget_from(f.max_memory);
        device.set_memory_budget(budget);
        f.mesh.tsdf.working_bytes = static_cast<std::uint64_t>(kWorkingShare * double(budget));
    }
    SceneMesh made =
        mesh_scene(device, model, views, f.mesh, photos ? &*photos : nullptr, progress);
    note_thin_parts(made.report.thin_share);
    note_faces_left(made.mesh.face_count(), f.mesh.faces);
    MeshResult result{{},
                      {},
                      report_json(f, made, model.metres_per_unit),
                      report_text(f, made, model.metres_per_unit)};
    if (!f.reference.path.empty()) {
        progress("comparison", 0);
        const ReferenceComparison found = compare_with_reference(made, f.reference);
        say_notes(found.notes);
        result.report["comparison"] = comparison_json(found.comparison);
        result.paper = comparison_report(f, found.comparison);
        if (found.alignment) {
            result.report["alignment"] = alignment_json(*found.alignment);
            result.text += alignment_text(*found.alignment);
        }
        result.text += comparison_text(found.comparison);
    }
    result.mesh = std::move(made.mesh);
    result.texture = std::move(made.texture);
    progress("files", 0);
    return result;
}

glm::dvec3 up_of_scene(const MeshFlags& flags, const SplatModel& model,
                       const std::vector<Camera>& cameras, const std::string& stated) {
    if (!flags.up.empty()) return up_from_name(flags.up);
    if (const auto held = up_of_cameras(cameras)) return *held;
    return stated.empty() ? guess_up(model) : up_from_name(stated);
}

MeshResult make_collision_mesh(const MeshFlags& flags, const MeshProgress& progress) {
    SplatFile facts;
    const SplatModel model = opened_scene(flags, &facts);
    const std::vector<Camera> cameras = cameras_of(known_views(flags));
    SceneColliderOptions options;
    options.collider.kind = *collider_kind_from_name(flags.collider);
    options.collider.faces = flags.mesh.faces > 0 ? flags.mesh.faces : kColliderFaces;
    if (!flags.capsule.empty()) {
        const std::vector<double> size = numbers_from("--capsule", flags.capsule, 2);
        options.collider.radius = size[0];
        options.collider.height = size[1];
        if (!(size[0] > 0 && size[1] >= 2 * size[0]))
            throw Error("--capsule " + flags.capsule, "is not a radius and a height of twice it",
                        "Give them in world units, as --capsule 0.2,1.6.");
    }
    options.cell = flags.mesh.tsdf.voxel;
    if (!flags.bounds.empty()) options.bounds = box_from(flags.bounds, model.origin);
    options.up = up_of_scene(flags, model, cameras, facts.up);
    progress("cells", 0);
    SceneCollider made = collide_scene(model, cameras, options, progress);
    const Topology topology = topology_of(made.mesh);
    const glm::dvec3& up = options.up;
    MeshResult result{std::move(made.mesh), {}, {}, {}};
    result.report = {{"output", name_in_json(flags.json, flags.output)},
                     {"collider", flags.collider},
                     {"vertices", topology.vertices},
                     {"faces", topology.faces},
                     {"parts", topology.parts},
                     {"closed", topology.is_closed()},
                     {"manifold", topology.is_manifold()},
                     {"cell", made.cell},
                     {"cells", {made.cells.x, made.cells.y, made.cells.z}},
                     {"up", {up.x, up.y, up.z}},
                     {"cameras", cameras.size()}};
    result.text = fmt::format(
        "{} x {} x {} cells of {:.4g}; up is {:.3g}, {:.3g}, {:.3g}; {} cameras stand in what is "
        "free\ncollider: {} faces in {} part{}, {}\n",
        made.cells.x, made.cells.y, made.cells.z, made.cell, up.x, up.y, up.z, cameras.size(),
        topology.faces, topology.parts, topology.parts == 1 ? "" : "s",
        topology.is_closed() && topology.is_manifold() ? "closed" : "not closed");
    progress("files", 0);
    return result;
}

void check_output(const MeshFlags& flags) {
    if (mesh_endings().find(flags.output.extension().string()) == std::string::npos ||
        flags.output.extension().empty())
        throw Error(flags.output.string(), "has no ending of a mesh",
                    "Use " + mesh_endings() + ".");
    if (flags.mesh.texture != MeshTexturing::photos && flags.seams != "level")
        throw Error("--seams " + flags.seams, "only photos have seams",
                    "Add --texture photos, or leave --seams out.");
    if (has_pages(flags.mesh.texture) && has_extension(flags.output, ".ply"))
        throw Error(flags.output.string(), "a .ply has no place for a texture",
                    "Write .glb, .gltf or .obj, or take --texture vertex.");
    if (flags.mesh.faces > 0 && !can_simplify())
        throw Error("--faces", "this darb was built without meshoptimizer",
                    "Install libmeshoptimizer-dev and build it again, or leave --faces out.");
}

int mesh(const MeshFlags& flags) {
    const Paths inputs =
        together({files_of(flags.scene), files_of(flags.cameras), Paths{flags.reference.path}});
    refuse_to_overwrite_inputs({flags.output, flags.json}, inputs, Replaces::all);
    const WrittenFiles written(files_of(flags.scene), flags.force);
    written.check({flags.output});
    check_output(flags);
    check_paper_folder(flags.paper);
    const MeshProgress progress = stoppable_progress(stop_on_signals());
    MeshResult result;
    EncodedSplats encoded;
    try {
        result = flags.collider.empty() ? make_surface(flags, progress)
                                        : make_collision_mesh(flags, progress);
        encoded = encode_mesh(result.mesh, flags.output.string(),
                              result.texture ? &*result.texture : nullptr);
        progress("files", 1);
    } catch (const MeshStopped&) {
        say("stopped by {}: nothing was written\n", stop_name());
        return stop_exit_code();
    }
    const Paths outputs = outputs_of(flags.output, encoded);
    written.check(outputs);
    write_encoded(flags.output, encoded);
    written.wrote(outputs);
    write_json(flags.json, result.report);
    tell(stream_beside_json(flags.json, flags.quiet), "{}", result.text);
    if (!flags.reference.path.empty())
        write_paper(flags.paper, result.paper, together({inputs, outputs}));
    tell_paths(flags.quiet, together({outputs, {flags.json, flags.paper}}));
    return 0;
}

/// Options that only a surface has, or only a collider.
struct OptionGroups {
    std::vector<CLI::Option*> surface, collider;
};

void add_surface_options(CLI::App& c, MeshFlags& flags, OptionGroups& groups) {
    groups.surface.push_back(
        c.add_option("--method", flags.method,
                     "tsdf: the mean of the distances that the views measure; opacity: where the "
                     "opacity field passes 1 - level, which keeps thin things and takes longer")
            ->capture_default_str()
            ->check(CLI::IsMember(
                std::vector<std::string>(std::begin(kMeshMethods), std::end(kMeshMethods)))));
    groups.surface.push_back(
        c.add_option(
             "--depth", flags.reading,
             "how a splat absorbs light along a ray: front, solid, plane, or expected, which is "
             "the mean of the centres")
            ->default_str("front; of kernels with several pulses plane")
            ->check(CLI::IsMember(
                std::vector<std::string>(std::begin(kDepthReadings), std::end(kDepthReadings)))));
    groups.surface.push_back(
        c.add_option("--level", flags.mesh.level, "share of the light that is left at the surface")
            ->capture_default_str()
            ->check(CLI::Range(0.01, 0.99)));
    c.add_option("--voxel", flags.mesh.tsdf.voxel, "side of a voxel, world units")
        ->default_str("the median size of a pixel on the surface; for a collider 1/256 of its box")
        ->check(above_zero());
    groups.surface.push_back(c.add_option("--truncation", flags.mesh.tsdf.truncation,
                                          "half the width of the band around a depth, voxels")
                                 ->capture_default_str()
                                 ->check(CLI::Range(2, 16)));
    groups.surface.push_back(
        c.add_option("--far", flags.mesh.tsdf.farthest, "largest depth that counts, world units")
            ->default_str("4 times the median depth")
            ->check(above_zero()));
    groups.surface.push_back(
        c.add_option("--near", flags.mesh.near_plane, "smallest depth that counts, world units")
            ->capture_default_str()
            ->check(above_zero()));
    c.add_option("--bounds", flags.bounds, "X0,Y0,Z0,X1,Y1,Z1: a box that the mesh stays in")
        ->default_str("what two views see");
    c.add_option("--max-memory", flags.max_memory,
                 "limit for device memory, such as 800MB or 1.5GB; the mesh has the same bits with "
                 "any limit")
        ->default_str("none");
}

void add_cleaning_options(CLI::App& c, MeshFlags& flags, OptionGroups& groups) {
    c.add_option("--faces", flags.mesh.faces, "simplify the mesh to this many faces")
        ->default_str("off; for a collider 5000")
        ->check(CLI::Range(4, 2'000'000'000));
    groups.surface.push_back(
        c.add_option("--keep", flags.mesh.keep, "keep only this many parts, the largest ones")
            ->default_str("all"));
    groups.surface.push_back(
        c.add_option(
             "--min-island", flags.mesh.min_island,
             "drop parts with fewer faces than this, or less than 10 voxels across; 0 keeps "
             "all parts")
            ->capture_default_str());
    groups.surface.push_back(
        c.add_option("--fill-holes", flags.mesh.fill_holes,
                     "close holes whose rim is shorter than this, in world units, and through "
                     "which no camera looks")
            ->default_str("off")
            ->check(above_zero()));
    CLI::Option* const texture =
        c.add_option(
             "--texture", flags.texture,
             "vertex: a colour at each vertex; splats or photos: pictures laid on the faces "
             "(pages), painted from the scene's own pictures or its photos; none: no colours")
            ->capture_default_str()
            ->check(CLI::IsMember(
                std::vector<std::string>(std::begin(kMeshTexturings), std::end(kMeshTexturings))));
    groups.surface.push_back(texture);
    groups.surface.push_back(
        c.add_option("--texel", flags.mesh.texel, "side of a texel of the pages, world units")
            ->default_str("half a voxel")
            ->check(above_zero())
            ->needs(texture));
    groups.surface.push_back(
        c.add_option(
             "--seams", flags.seams,
             "with --texture photos, where one photo ends and the next begins: level changes "
             "the colours of both smoothly until they meet; keep leaves them as they were "
             "taken")
            ->capture_default_str()
            ->check(CLI::IsMember({"level", "keep"}))
            ->needs(texture));
}

void add_reference_options(CLI::App& c, MeshFlags& flags, OptionGroups& groups) {
    CLI::Option* const reference =
        c.add_option("--reference", flags.reference.path,
                     "compare the mesh with this: a mesh or points (" + mesh_endings() +
                         "), or a .json of exact shapes");
    c.add_option("--thresholds", flags.reference.thresholds,
                 "distances of the F-score, world units, separated by commas")
        ->delimiter(',')
        ->check(above_zero())
        ->default_str("1, 2 and 4 voxels")
        ->needs(reference);
    c.add_option("--align", flags.align,
                 "first bring the reference to the mesh: rigid turns and moves it, similarity "
                 "scales it as well")
        ->default_str("off")
        ->check(CLI::IsMember({"rigid", "similarity"}))
        ->needs(reference);
    groups.surface.push_back(reference);
    groups.surface.push_back(add_paper_option(c, flags.paper)->needs(reference));
}

void add_collider_options(CLI::App& c, MeshFlags& flags, OptionGroups& groups) {
    CLI::Option* const collider = c.add_option(
        "--collider", flags.collider,
        "instead of the surface, make a closed mesh for a physics engine, of a room, a ground or "
        "an object; no camera ends up inside what is solid");
    collider->check(CLI::IsMember({"room", "ground", "object"}))->default_str("off");
    groups.collider.push_back(c.add_option("--capsule", flags.capsule,
                                           "radius and height of whoever walks there, world units")
                                  ->default_str("0.2,1.6"));
    groups.collider.push_back(
        c.add_option("--up", flags.up,
                     "up axis: x, -x, y, -y, z or -z (default: as the cameras were held, else what "
                     "the file says, else a guess)"));
    for (CLI::Option* const option : groups.surface) option->excludes(collider);
    for (CLI::Option* const option : groups.collider) option->needs(collider);
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
                        "the cameras that look at the surface: a cameras.json, a transforms.json "
                        "or a data set (default: those of the scene's run, else 32 around it)");
    command->add_option(
        "-r,--resolution", flags->data.resolution,
        "of a data set's cameras: 1, 2, 4 or 8 to divide their size, or a width in px");
    OptionGroups groups;
    add_surface_options(*command, *flags, groups);
    add_cleaning_options(*command, *flags, groups);
    add_reference_options(*command, *flags, groups);
    add_collider_options(*command, *flags, groups);
    command->add_flag("--force", flags->force, "replace a file that darb did not write");
    add_json_option(*command, flags->json);
    add_kernel_flags(*command, flags->kernel, "draw with it in place of the scene's own");
    add_effects_flag(*command, flags->effects);
    command->add_option("--device", flags->device, "number or part of a name, see `darb devices`");
    add_tune_flags(*command, flags->tune);
    add_quiet_flag(*command, flags->quiet);
    add_unit_options(*command, flags->units);
    command->callback([flags, &action] {
        flags->mesh.texture = *mesh_texturing_from_name(flags->texture);
        flags->mesh.level_seams = flags->seams == "level";
        flags->reference.align = align_kind_from_name(flags->align);
        action = [flags] { return mesh(*flags); };
    });
}

}  // namespace darb
