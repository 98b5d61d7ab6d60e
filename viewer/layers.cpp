// SPDX-License-Identifier: MIT
#include "viewer/layers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <utility>

#include "engine/core/error.h"
#include "engine/scene/splat_file.h"
#include "viewer/controls.h"
#include "viewer/session.h"
#include "viewer/tools.h"

namespace darb {

LayerPose pose_of(const Similarity& moved) {
    const glm::dmat3& m = moved.turn;
    const double sine = std::clamp(-m[0][2], -1.0, 1.0);
    glm::dvec3 turn(std::atan2(m[1][2], m[2][2]), std::asin(sine), std::atan2(m[0][1], m[0][0]));
    // At a right angle about y, turns about x and z are the same.
    constexpr double kRight = 1 - 1e-12;
    if (std::abs(sine) > kRight) turn = {std::atan2(-m[2][1], m[1][1]), turn.y, 0};
    return {moved.translation, glm::degrees(turn) + 0.0, moved.scale};  // 0 for -0
}

Similarity moved_by(const LayerPose& pose) {
    return {pose.scale, turn_of_degrees(pose.turn), pose.move};
}

void perform_edit(const EditOperation& operation, Session& s) {
    if (!s.scene || s.edit.transforms()) return;
    s.attempt([&] { show_edit(s.edit.perform(operation, s.scene->model), s); });
}

void pose_layer(std::size_t layer, const LayerPose& pose, Session& s) {
    const SceneLayer& moved = s.edit.layers().at(layer);
    if (pose == pose_of(moved.moved)) return;
    perform_edit(edits::Transform{followed_by(inverse(moved.moved), moved_by(pose)), moved.name},
                 s);
}

NoteCamera camera_of_view(const Navigation& view) {
    return {view.eye, glm::quat_cast(view.axes), view.fov_y};
}

void set_note(int replaces, SceneNote note, Session& s) {
    if (note.title.empty()) return;
    note.camera = camera_of_view(s.navigation);
    SceneFacts facts = s.edit.facts();
    const bool changes = replaces >= 0 && replaces < static_cast<int>(facts.notes.size());
    const std::string what = (changes ? "changed the note " : "added the note ") + note.title;
    if (changes)
        facts.notes[static_cast<std::size_t>(replaces)] = std::move(note);
    else
        facts.notes.push_back(std::move(note));
    if (s.edit.state(facts, what, true) > 0) s.tell(what);
}

void remove_note(std::size_t note, Session& s) {
    SceneFacts facts = s.edit.facts();
    if (note >= facts.notes.size()) return;
    const std::string what = "deleted the note " + facts.notes[note].title;
    facts.notes.erase(facts.notes.begin() + static_cast<std::ptrdiff_t>(note));
    if (s.edit.state(facts, what, true) > 0) s.tell(what);
}

namespace {

void look_from_camera(const NoteCamera& camera, Session& s) {
    leave_photo(s);
    s.navigation.eye = camera.eye;
    s.navigation.axes = glm::mat3_cast(camera.orientation);
    s.navigation.fov_y = camera.fov_y;
}

std::filesystem::path cameras_of_scene(const Session& s) {
    const std::filesystem::path run = run_of_scene(s.edit.layers().front().file);
    std::error_code none;
    if (run.empty() || !std::filesystem::is_regular_file(run / "cameras.json", none)) return {};
    return run / "cameras.json";
}

}  // namespace

void look_at_note(const SceneNote& note, Session& s) {
    if (note.camera) look_from_camera(*note.camera, s);
    s.navigation.set_pivot_depth(note.at);
}

bool keeps_project(const Session& s) {
    return s.scene &&
           (!s.project.file.empty() || s.edit.layers().size() > 1 || !s.edit.facts().notes.empty());
}

Project project_of_session(const Session& s) {
    if (!s.scene) throw Error("project", "there is no scene", "Open one.");
    Project project = project_of(s.edit, s.project.first_file, s.project.first_name);
    project.cameras = s.project.cameras.empty() ? cameras_of_scene(s) : s.project.cameras;
    for (const KeyFrame& key : s.path.path.keys)
        project.path.push_back({key.seconds, {key.eye, key.orientation, key.fov_y}});
    const glm::vec3 ground = s.display.background;
    project.view = ProjectView{camera_of_view(s.navigation), s.navigation.distance, s.navigation.up,
                               glm::dvec3(ground), s.navigation.centre_x};
    return project;
}

bool take_project(const Project& project, Session& s) {
    if (!project.cameras.empty()) s.project.cameras = project.cameras;
    if (!project.path.empty()) {
        s.path.path = {};
        for (const ProjectKey& key : project.path)
            s.path.path.keys.push_back(
                {key.seconds, key.camera.eye, key.camera.orientation, key.camera.fov_y});
        s.path.mark_saved();
    }
    if (!project.view) return false;
    s.navigation.set_up(project.view->up);
    look_from_camera(project.view->camera, s);
    s.navigation.distance = std::max(project.view->distance, 1e-9);
    s.navigation.centre_x = project.view->centre_x;
    s.display.background = glm::vec3(project.view->background);
    return true;
}

}  // namespace darb
