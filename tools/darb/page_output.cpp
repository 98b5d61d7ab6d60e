// SPDX-License-Identifier: MIT
#include "tools/darb/page_output.h"

#include <fmt/format.h>

#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/say.h"
#include "engine/core/text.h"
#include "engine/data/camera_list.h"
#include "engine/mesh/mesh_file.h"
#include "engine/mesh/scene_mesh.h"
#include "engine/publish/web_page.h"
#include "engine/scene/merge_splats.h"
#include "engine/scene/splat_file.h"
#include "engine/scene/subject.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/outputs.h"

namespace darb {

namespace {

/// Reads black, white or #rrggbb.
glm::vec3 parse_colour(const std::string& text) {
    if (lower(text) == "black") return glm::vec3(0);
    if (lower(text) == "white") return glm::vec3(1);
    const std::string digits = text.starts_with('#') ? text.substr(1) : std::string();
    if (digits.size() != 6 || digits.find_first_not_of("0123456789abcdefABCDEF") != digits.npos)
        throw Error("--background " + printable(text), "is no colour",
                    "Give black, white or six digits, as '#20304a'.");
    const auto part = [&](std::size_t at) {
        return static_cast<float>(std::stoi(digits.substr(at, 2), nullptr, 16)) / 255;
    };
    return {part(0), part(2), part(4)};
}

}  // namespace

void move_camera(const Similarity& similarity, Camera& camera) {
    camera.rotation = camera.rotation * glm::transpose(similarity.turn);
    camera.translation =
        similarity.scale * camera.translation - camera.rotation * similarity.translation;
}

void add_page_options(CLI::App& command, PageFlags& flags) {
    const std::string group = "Web page (.html)";
    command
        .add_flag("--web", flags.web,
                  "write a folder whose page fetches a large scene in parts, for a web server")
        ->group(group);
    command
        .add_option("--title", flags.title, "title of the page (default: the name of the scene)")
        ->group(group);
    command
        .add_option("--start-camera", flags.start_camera,
                    "name or number of the camera at which it opens (default: 1)")
        ->group(group);
    command.add_option("--background", flags.background, "black, white or '#rrggbb'")
        ->capture_default_str()
        ->group(group);
    command
        .add_flag("--exact", flags.exact,
                  "keep float32 values; otherwise they are rounded and the error is printed")
        ->group(group);
    command
        .add_option("--notes", flags.notes,
                    "notes at places of the scene: a JSON file with a list `notes`")
        ->group(group);
    CLI::Option* const collider =
        command
            .add_option("--collider", flags.collider,
                        "ground to walk on in the page: a mesh, as darb mesh --collider makes it")
            ->group(group);
    command
        .add_option("--walk", flags.walk,
                    "make that ground from the splats: of a room, a ground or an object")
        ->check(CLI::IsMember({"room", "ground", "object"}))
        ->excludes(collider)
        ->group(group);
    command
        .add_option("--poster", flags.poster,
                    "still, or 360: a picture all around while the page loads, and for devices "
                    "without WebGL 2")
        ->check(CLI::IsMember({"still", "360"}))
        ->capture_default_str()
        ->group(group);
}

bool is_page(const std::filesystem::path& output) {
    return has_extension(output, ".html") || has_extension(output, ".htm");
}

void check_page_options(const PageFlags& flags, const std::filesystem::path& output) {
    if (flags.web && flags.exact)
        throw Error("--exact", "is not for --web, whose values are those of SOG",
                    "Leave it out, or write one file that ends in .html.");
    if (is_page(output) || flags.web) return;
    const PageFlags none;
    const char* given = !flags.title.empty()                  ? "--title"
                        : !flags.start_camera.empty()         ? "--start-camera"
                        : flags.background != none.background ? "--background"
                        : flags.exact                         ? "--exact"
                        : !flags.notes.empty()                ? "--notes"
                        : !flags.collider.empty()             ? "--collider"
                        : !flags.walk.empty()                 ? "--walk"
                        : flags.poster != none.poster         ? "--poster"
                                                              : nullptr;
    if (given) throw Error(given, "is an option of web pages", "Let the output end in .html.");
}

std::vector<View> named_views(const std::filesystem::path& cameras) {
    if (cameras.empty()) return {};
    std::vector<View> views = open_cameras(cameras);
    if (views.empty())
        throw Error(cameras.string(), "holds no cameras", "Name another list or data set.");
    return views;
}

namespace {

constexpr std::size_t kCoarsestSplats = 16 << 10;  // of the level that a page shows first
constexpr std::size_t kWebFileSplats = 64 << 10;

std::vector<PageNote> moved_notes(const PageFlags& flags) {
    if (flags.notes.empty()) return {};
    std::vector<PageNote> notes = read_page_notes(flags.notes);
    for (PageNote& note : notes) {
        note.at = moved_point(flags.moved, note.at);
        if (note.view) move_camera(flags.moved, note.view->camera);
    }
    return notes;
}

PageCollider page_collider(const TriangleMesh& mesh, const Similarity& moved) {
    PageCollider collider;
    const glm::dvec3 origin(mesh.origin[0], mesh.origin[1], mesh.origin[2]);
    for (const glm::vec3& p : mesh.position)
        collider.position.push_back(moved_point(moved, glm::dvec3(p) + origin));
    collider.face = mesh.face;
    return collider;
}

/// From a file, or made of the splats; nothing where nobody wants to walk.
std::optional<PageCollider> wanted_collider(const SplatModel& model, const PageFlags& flags,
                                            const std::vector<View>& views) {
    constexpr std::size_t kMostFaces = 200'000;
    if (flags.collider.empty() && flags.walk.empty()) return {};
    PageCollider collider;
    if (!flags.collider.empty()) {
        const TriangleMesh mesh = read_mesh(flags.collider);
        if (mesh.face_count() == 0 || mesh.face_count() > kMostFaces)
            throw Error(flags.collider.string(),
                        fmt::format("has {} faces; 1 to {} can be walked on", mesh.face_count(),
                                    kMostFaces),
                        "Make one with darb mesh SCENE -o walls.glb --collider room.");
        collider = page_collider(mesh, flags.moved);
    } else {
        SceneColliderOptions options;
        options.collider.kind = *collider_kind_from_name(flags.walk);
        options.collider.faces = kColliderFaces;
        const double unit = model.metres_per_unit > 0 ? 1 / model.metres_per_unit : 1;
        options.collider.radius *= unit;
        options.collider.height *= unit;
        const std::vector<Camera> cameras = cameras_of(views);
        options.up = flags.up ? *flags.up : up_of_cameras(cameras).value_or(guess_up(model));
        collider = page_collider(collide_scene(model, cameras, options).mesh, Similarity{});
    }
    collider.metres_per_unit = model.metres_per_unit;
    return collider;
}

WebPageOptions page_options(const SplatModel& model, const PageFlags& flags,
                            const std::string& title, std::vector<View> views) {
    WebPageOptions options;
    options.notes = moved_notes(flags);
    options.collider = wanted_collider(model, flags, views);
    options.panorama = flags.poster == "360";
    options.title = flags.title.empty() ? title : flags.title;
    options.start = flags.start_camera;
    options.background = parse_colour(flags.background);
    options.exact = flags.exact;
    options.max_bytes = flags.max_bytes;
    options.views = std::move(views);
    options.up = flags.up;
    return options;
}

}  // namespace

std::string write_page(Device& device, const SplatModel& model, const PageFlags& flags,
                       const std::string& title, std::vector<View> views,
                       const std::filesystem::path& output) {
    WebPageOptions options = page_options(model, flags, title, std::move(views));
    SlowProgress progress("measuring");
    options.progress = [&](std::size_t pictures) { progress.at(pictures, "pictures"); };
    WebPageFacts facts;
    write_file_atomic(output, make_web_page(device, model, options, &facts));
    return fmt::format("{}: {}\n", printable(output.string()), web_page_text(facts));
}

std::vector<std::size_t> web_levels(std::size_t splats) {
    std::vector<std::size_t> counts;
    while (splats > kCoarsestSplats) counts.push_back(splats /= 4);
    return counts;
}

std::string write_web_folder(Device& device, SplatModel& model, const PageFlags& flags,
                             const std::string& title, std::vector<View> views, const WebFolder& to,
                             Paths& written) {
    constexpr SplatFormat kFormat = SplatFormat::streamed_sog;
    const std::filesystem::path lod_meta = to.folder / "lod-meta.json",
                                index = to.folder / "index.html";
    WebPageOptions options = page_options(model, flags, title, std::move(views));
    SlowProgress merging("merging"), palettes("palettes of harmonics"), pictures("measuring");
    options.progress = [&](std::size_t count) { pictures.at(count, "pictures"); };
    const int kernel = std::exchange(model.kernel, KERNEL_GAUSSIAN);  // the page has its kernel
    const Footprint footprint = std::exchange(model.footprint, Footprint::psi);
    for (const std::string& loss : losses_of(kFormat, model, lod_meta.string()))
        say("warning: {}: {}\n", lod_meta.string(), loss);
    model.kernel = kernel;
    model.footprint = footprint;
    drop_unwritable(kFormat, model);
    EncodeOptions encode;
    encode.file_splats = kWebFileSplats;
    encode.assign_rows = to.assign_rows;
    encode.progress = [&](double share) { palettes.at(share); };
    encode.coarser =
        merge_levels(model, to.counts, {.progress = [&](double share) { merging.at(share); }});
    for (SplatModel& level : encode.coarser) drop_unwritable(kFormat, level);
    const EncodedSplats encoded = encode_scene(kFormat, model, lod_meta.string(), encode);
    written = together({outputs_of(lod_meta, encoded), {index}});
    to.check(written);
    write_encoded(lod_meta, encoded);
    WebPageFacts facts;
    write_file_atomic(index, make_streamed_page(device, model, load_splats(lod_meta),
                                                encode.coarser.size() + 1, options, &facts));
    return fmt::format("{}: {} splats in {} levels and {} files, {} bytes, page of {} bytes: {}\n",
                       printable(index.string()), facts.splats, encode.coarser.size() + 1,
                       written.size(), encoded.bytes(), facts.bytes, loss_text(facts.loss));
}

std::FILE* stream_beside(const std::filesystem::path& output) {
    return std::filesystem::exists(output) && !std::filesystem::is_regular_file(output) ? stderr
                                                                                        : stdout;
}

}  // namespace darb
