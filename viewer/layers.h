// SPDX-License-Identifier: MIT
// Layers, notes and the project of a session: what the panels ask for, and what a project keeps.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <string>

#include "engine/scene/edit_operation.h"
#include "engine/scene/project_file.h"

namespace darb {

struct Session;
struct Navigation;

/// How a layer was moved, as numbers for people. turn: degrees about x, then y, then z.
struct LayerPose {
    glm::dvec3 move{0.0}, turn{0.0};
    double scale = 1;
    bool operator==(const LayerPose&) const = default;
};
LayerPose pose_of(const Similarity& moved);
Similarity moved_by(const LayerPose& pose);

/// Does the edit and shows it, or its error; nothing while a hand moves splats.
void perform_edit(const EditOperation& operation, Session& session);
/// Gives a layer this pose, with one step.
void pose_layer(std::size_t layer, const LayerPose& pose, Session& session);

/// Adds a note, or replaces one (from 0); -1: a new one. It is seen from the current camera.
void set_note(int replaces, SceneNote note, Session& session);
void remove_note(std::size_t note, Session& session);
/// Looks at the note from where it was made.
void look_at_note(const SceneNote& note, Session& session);

/// Whether a save keeps the project, rather than one file of splats: where there are several layers
/// or notes, or a project is open.
bool keeps_project(const Session& session);
/// Everything that a project holds of the session. Throws Error.
Project project_of_session(const Session& session);
/// Takes path, view and cameras of a project that was opened. Returns whether it had a view.
bool take_project(const Project& project, Session& session);

NoteCamera camera_of_view(const Navigation& view);

}  // namespace darb
