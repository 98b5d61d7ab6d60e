// SPDX-License-Identifier: MIT
#include "engine/scene/project_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/json_text.h"
#include "engine/core/text.h"
#include "engine/scene/edit_script.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/json_fields.h"
#include "engine/scene/splat_file.h"

namespace darb {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr int kProjectVersion = 1;
constexpr double kMostNumber = std::numeric_limits<double>::max();
constexpr double kMostSeconds = 24 * 3600;
constexpr double kUnitLength = 1e-6;  // how far a direction may be off length 1
constexpr const char* kProjectHint =
    "A project is saved by `darb view`; docs/formats.md lists what it holds.";

// Cameras of notes, key frames and the view.

json json_of_camera(const NoteCamera& c) {
    const glm::dquat& q = c.orientation;
    return {{"eye", json_of(c.eye)},
            {"orientation", {q.w, q.x, q.y, q.z}},
            {"fov_y_degrees", glm::degrees(c.fov_y)}};
}

NoteCamera camera_in(JsonFields& fields) {
    NoteCamera c;
    c.eye = fields.vector("eye");
    const std::vector<double> q = fields.numbers("orientation", 4);
    c.orientation = glm::dquat(q[0], q[1], q[2], q[3]);
    if (!(glm::length(c.orientation) > 1e-6 && glm::length(c.orientation) < 1e6))
        fields.refuse("orientation", "is not a quaternion w, x, y, z");
    c.orientation = glm::normalize(c.orientation);
    const double degrees = fields.number("fov_y_degrees");
    if (!(degrees > 0 && degrees < 180)) fields.refuse("fov_y_degrees", "is not between 0 and 180");
    c.fov_y = glm::radians(degrees);
    return c;
}

glm::dvec3 direction_in(JsonFields& fields, const char* key) {
    const glm::dvec3 v = fields.vector(key);
    if (!(std::abs(glm::length(v) - 1) <= kUnitLength)) fields.refuse(key, "is not of length 1");
    return v;
}

/// read(fields) for each object of the list at the key.
template <class Read>
void read_objects(JsonFields& fields, const char* key, const Read& read) {
    std::size_t n = 0;
    for (const json& entry : fields.list(key)) {
        JsonFields one(entry, fields.place(key, n++), fields.hint());
        read(one);
        one.done();
    }
}

std::string named_file(JsonFields& fields, const char* key) {
    std::string name = fields.text(key);
    if (name.empty()) fields.refuse(key, "is empty");
    return name;
}

ProjectLayer layer_in(JsonFields& fields, const fs::path& folder) {
    ProjectLayer layer;
    layer.file = file_from(folder, named_file(fields, "file"));
    layer.name = fields.text_or("name", "");
    layer.visible = fields.flag_or("visible", true);
    if (fields.has("transform")) layer.transform = similarity_in(fields.object("transform"));
    return layer;
}

ProjectFile file_in(JsonFields& fields, const fs::path& folder) {
    ProjectFile file;
    file.file = file_from(folder, named_file(fields, "file"));
    constexpr double kMostBytes = 9e15;  // doubles count to there
    const double bytes = fields.number("bytes", 0, kMostBytes);
    if (std::floor(bytes) != bytes) fields.refuse("bytes", "is no whole number");
    file.bytes = static_cast<std::uint64_t>(bytes);
    file.hash = fields.text_or("hash", "");
    return file;
}

SceneNote note_in(JsonFields& fields) {
    SceneNote note;
    note.at = fields.vector("at");
    note.title = fields.text("title");
    note.text = fields.text_or("text", "");
    if (fields.has("camera")) {
        JsonFields camera = fields.object("camera");
        note.camera = camera_in(camera);
        camera.done();
    }
    return note;
}

Measurement measurement_in(JsonFields fields) {
    Measurement measured;
    for (const std::vector<double>& p : fields.rows("points", 3, 0))
        measured.points.emplace_back(p[0], p[1], p[2]);
    measured.closed = fields.flag_or("closed", false);
    if (measured.closed && measured.points.size() < 3)
        fields.refuse("closed", "is true of fewer than three points");
    fields.done();
    return measured;
}

ProjectView project_view_in(JsonFields fields) {
    ProjectView view;
    view.camera = camera_in(fields);
    view.distance = fields.number("distance", 0, kMostNumber);
    view.up = direction_in(fields, "up");
    if (fields.has("background")) view.background = fields.vector("background");
    view.background = glm::clamp(view.background, 0.0, 1.0);
    view.centre_x = fields.number_or("centre_x", 0, 1, view.centre_x);
    fields.done();
    return view;
}

json json_of_note(const SceneNote& note) {
    json j{{"at", json_of(note.at)}, {"title", note.title}, {"text", note.text}};
    if (note.camera) j["camera"] = json_of_camera(*note.camera);
    return j;
}

json json_of_layer(const ProjectLayer& layer, const fs::path& folder) {
    json j{{"file", name_from(folder, layer.file)}};
    if (!layer.name.empty()) j["name"] = layer.name;
    if (!layer.visible) j["visible"] = false;
    if (layer.transform != Similarity{}) j["transform"] = json_of(layer.transform);
    return j;
}

void put_path(const std::vector<ProjectKey>& path, json& whole) {
    for (const ProjectKey& key : path) {
        json j = json_of_camera(key.camera);
        j["seconds"] = key.seconds;
        whole["path"].push_back(std::move(j));
    }
}

void put_view(const ProjectView& view, json& whole) {
    json j = json_of_camera(view.camera);
    j["distance"] = view.distance;
    j["up"] = json_of(view.up);
    j["background"] = json_of(view.background);
    j["centre_x"] = view.centre_x;
    whole["view"] = std::move(j);
}

void put_measurement(const Measurement& measured, json& whole) {
    json points = json::array();
    for (const glm::dvec3& p : measured.points) points.push_back(json_of(p));
    whole["measurement"] = {{"points", std::move(points)}, {"closed", measured.closed}};
}

/// Each value of the object on a line, and each entry of a list.
std::string lines_of(const json& whole) {
    std::string text = "{";
    for (auto item = whole.begin(); item != whole.end(); ++item) {
        text += (item == whole.begin() ? "\n  " : ",\n  ") + json(item.key()).dump() + ": ";
        if (!item->is_array() || item->empty()) {
            text += item->dump();
            continue;
        }
        for (std::size_t i = 0; i < item->size(); ++i)
            text += (i == 0 ? "[\n    " : ",\n    ") + (*item)[i].dump();
        text += "\n  ]";
    }
    return text + "\n}\n";
}

/// FNV-1a of 64 bits. Source: http://www.isthe.com/chongo/tech/comp/fnv/
std::string hash_of(std::span<const std::byte> bytes) {
    std::uint64_t hash = 14695981039346656037u;
    for (const std::byte b : bytes)
        hash = (hash ^ std::to_integer<std::uint64_t>(b)) * 1099511628211u;
    return fmt::format("fnv1a64:{:016x}", hash);
}

/// The file that stands for a scene, which may be a folder.
fs::path main_file(const fs::path& scene) {
    return scene_file_in(scene).value_or(scene);
}

ProjectFile state_of(const fs::path& scene) {
    const std::vector<std::byte> bytes = read_file(main_file(scene));
    return {scene, bytes.size(), hash_of(bytes)};
}

void add_key(JsonFields& fields, std::vector<ProjectKey>& path) {
    ProjectKey key{fields.number("seconds", 0, kMostSeconds), camera_in(fields)};
    if (!path.empty() && key.seconds <= path.back().seconds)
        fields.refuse("seconds", "is not after the time of the key before it");
    path.push_back(key);
}

}  // namespace

bool is_project_file(const fs::path& file) {
    return lower(file.filename().string()).ends_with(".darb.json");
}

Project parse_project(std::string_view text, const std::string& where, const fs::path& folder) {
    const json whole = parse_json_text(text, where, kProjectHint);
    JsonFields fields(whole, where, kProjectHint);
    if (fields.number("darb_project") != kProjectVersion)
        fields.refuse("darb_project",
                      fmt::format("is not {}, the version that this darb knows", kProjectVersion));
    Project project;
    read_objects(fields, "layers",
                 [&](JsonFields& f) { project.layers.push_back(layer_in(f, folder)); });
    if (project.layers.empty())
        throw Error(where, "has no layers", "A project names at least one scene.");
    project.edits = edits_of_json(fields.list("edits"), where, kProjectHint, folder);
    read_objects(fields, "files",
                 [&](JsonFields& f) { project.files.push_back(file_in(f, folder)); });
    if (fields.has("cameras")) project.cameras = file_from(folder, named_file(fields, "cameras"));
    if (fields.has("measurement")) project.measured = measurement_in(fields.object("measurement"));
    read_objects(fields, "notes", [&](JsonFields& f) { project.notes.push_back(note_in(f)); });
    read_objects(fields, "path", [&](JsonFields& f) { add_key(f, project.path); });
    if (fields.has("view")) project.view = project_view_in(fields.object("view"));
    fields.done();
    return project;
}

std::string format_project(const Project& project, const fs::path& folder) {
    json whole{{"darb_project", kProjectVersion}};
    for (const ProjectLayer& layer : project.layers)
        whole["layers"].push_back(json_of_layer(layer, folder));
    whole["edits"] = json_of_edits(project.edits, folder);
    for (const ProjectFile& file : project.files)
        whole["files"].push_back(
            {{"file", name_from(folder, file.file)}, {"bytes", file.bytes}, {"hash", file.hash}});
    if (!project.cameras.empty()) whole["cameras"] = name_from(folder, project.cameras);
    if (!project.measured.points.empty()) put_measurement(project.measured, whole);
    for (const SceneNote& note : project.notes) whole["notes"].push_back(json_of_note(note));
    put_path(project.path, whole);
    if (project.view) put_view(*project.view, whole);
    return lines_of(whole);
}

Project read_project(const fs::path& file) {
    return parse_project(read_text_file(file), file.string(), file.parent_path());
}

void write_project(const fs::path& file, const Project& project) {
    try {
        write_file_atomic(file, format_project(project, file.parent_path()));
    } catch (const json::exception&) {  // the only text that JSON cannot hold
        throw Error(file.string(), "names a file or a layer whose name is not UTF-8", "Rename it.");
    }
}

namespace {

SplatModel levelled(const Edit& edit, SplatModel model) {
    if (edit.facts().ground) transform_splats({.turn = turn_to_up(*edit.facts().up)}, model);
    return model;
}

}  // namespace

SplatModel EditedScene::saved() const {
    return levelled(edit, edit.apply(model));
}

SplatModel EditedScene::saved(const SceneLayer& layer) const {
    return levelled(edit, edit.apply(model, layer));
}

EditedScene perform_project(const Project& project, const std::string& where,
                            const ReadScene& read) {
    EditedScene scene;
    for (std::size_t n = 0; n < project.layers.size(); ++n) {
        const ProjectLayer& layer = project.layers[n];
        const std::string name = layer.name.empty() ? scene_name(layer.file, false) : layer.name;
        if (n == 0) {
            scene.model = read(layer.file);
            scene.edit = Edit(scene.model, name, layer.file);
        } else if (scene.edit.perform(edits::Add{layer.file, name}, scene.model, read) == 0) {
            throw Error(layer.file.string(), "has no splats", "Take it out of the project.");
        }
        const std::string given = scene.edit.layers().back().name;
        if (layer.transform != Similarity{})
            scene.edit.perform(edits::Transform{layer.transform, given}, scene.model);
        if (!layer.visible) scene.edit.perform(edits::ShowLayer{given, false}, scene.model);
    }
    for (std::size_t i = 0; i < project.edits.size(); ++i) try {
            scene.edit.perform(project.edits[i], scene.model, read);
        } catch (const Error& e) {
            throw Error(fmt::format("{}: edits[{}]: {}", where, i, e.where), e.reason, e.hint);
        }
    scene.edit.note_measured(project.measured, project.notes);
    return scene;
}

// Scenes that were added first of all are layers; those that came between other edits stay there.
Project project_of(const Edit& edit, const fs::path& first_file, const std::string& first_name) {
    if (first_file.empty())
        throw Error("project", "the scene did not come from a file", "Save the scene first.");
    Project project;
    project.layers.push_back({first_name, first_file, true, {}});
    bool begins = true;
    const auto note_file = [&](const fs::path& file) {
        if (std::ranges::none_of(project.files,
                                 [&](const ProjectFile& f) { return f.file == file; }))
            project.files.push_back(state_of(file));
    };
    note_file(first_file);
    for (const EditOperation& operation : edit.operations()) {
        const auto* add = std::get_if<edits::Add>(&operation);
        if (add != nullptr) note_file(add->file);
        begins = begins && add != nullptr;
        if (begins)
            project.layers.push_back({add->name, add->file, true, {}});
        else
            project.edits.push_back(operation);
    }
    project.measured = edit.facts().measured;
    project.notes = edit.facts().notes;
    return project;
}

std::vector<std::string> changed_files(const Project& project, const std::string& where) {
    std::vector<std::string> said;
    std::error_code none;
    for (const fs::path& file : files_of_project(project))
        if (!fs::exists(file, none))
            throw Error(where, fmt::format("names {}, which is not there", file.string()),
                        "Put the file back, or change its name in the project.");
    for (const ProjectFile& file : project.files) {
        const std::uintmax_t bytes = fs::file_size(main_file(file.file), none);
        if (bytes == file.bytes && (file.hash.empty() || state_of(file.file).hash == file.hash))
            continue;
        said.push_back(
            fmt::format("{} has changed since the project was saved; edits may now mean "
                        "other splats of it",
                        file.file.string()));
    }
    return said;
}

std::vector<fs::path> files_of_project(const Project& project) {
    std::vector<fs::path> files;
    for (const ProjectLayer& layer : project.layers) files.push_back(layer.file);
    for (const EditOperation& operation : project.edits)
        if (const auto* add = std::get_if<edits::Add>(&operation)) files.push_back(add->file);
    if (!project.cameras.empty()) files.push_back(project.cameras);
    return files;
}

}  // namespace darb
