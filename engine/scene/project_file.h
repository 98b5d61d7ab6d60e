// SPDX-License-Identifier: MIT
// Projects, NAME.darb.json: the scenes that lie together as layers, the edits of them, and what a
// window keeps beside: measurements, notes, a camera path, the view. The splats stay in their
// files, which a project names relative to itself, with sizes and hashes that tell when a file has
// changed. docs/formats.md has every key.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/scene/edit.h"
#include "engine/scene/edit_operation.h"
#include "engine/scene/measure.h"

namespace darb {

struct ProjectLayer {
    std::string name;  // empty: that of the file
    std::filesystem::path file;
    bool visible = true;
    Similarity transform;  // before all edits
};

/// What a file of a project was when the project was saved.
struct ProjectFile {
    std::filesystem::path file;
    std::uint64_t bytes = 0;
    std::string hash;  // empty: not known
};

struct ProjectKey {
    double seconds = 0;
    NoteCamera camera;
};

struct ProjectView {
    NoteCamera camera;
    double distance = 1;         // world, from the eye to what it turns around
    glm::dvec3 up{0, -1, 0};     // unit vector
    glm::dvec3 background{0.0};  // sRGB, 0 to 1
    double centre_x = 0.5;       // share of the width left of the middle of what is looked at
};

struct Project {
    std::vector<ProjectLayer> layers;  // at least one; each is added as in the window
    std::vector<EditOperation> edits;  // after that, in this order
    std::vector<ProjectFile> files;
    std::filesystem::path cameras;  // a data set or a list of cameras; empty: none
    Measurement measured;
    std::vector<SceneNote> notes;
    std::vector<ProjectKey> path;  // key frames of a camera path
    std::optional<ProjectView> view;
};

/// Whether the name ends in .darb.json.
bool is_project_file(const std::filesystem::path& file);

/// folder: the one from which the names of files count. Throws Error naming the place.
Project parse_project(std::string_view text, const std::string& where,
                      const std::filesystem::path& folder);
std::string format_project(const Project& project, const std::filesystem::path& folder);
Project read_project(const std::filesystem::path& file);
void write_project(const std::filesystem::path& file, const Project& project);

/// Layers and edits of a project, performed. Throws Error naming the layer or the edit.
struct EditedScene {
    SplatModel model;
    Edit edit;
    /// What a file of it gets: Edit::apply, level where a ground was stated.
    SplatModel saved() const;
    /// The same of one layer.
    SplatModel saved(const SceneLayer& layer) const;
};
/// where: the project's file, for messages.
EditedScene perform_project(const Project& project, const std::string& where,
                            const ReadScene& read);

/// The layers, edits and files of a scene that was edited, with the facts beside: what it takes to
/// come back to it. The files are read for their hashes. Throws Error for a scene that did not come
/// from a file.
Project project_of(const Edit& edit, const std::filesystem::path& first_file,
                   const std::string& first_name);

/// A sentence for each file that is not as it was when the project was saved. Throws Error where
/// one is missing.
std::vector<std::string> changed_files(const Project& project, const std::string& where);

/// All files that the project names: scenes and cameras.
std::vector<std::filesystem::path> files_of_project(const Project& project);

}  // namespace darb
