// SPDX-License-Identifier: MIT
// One step of an edit as a value. The window makes such values of what a user does, a script and a
// project hold them as JSON (edit_script.h), and `darb edit` reads them; Edit::perform is what each
// of them does.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <variant>

#include "engine/scene/select.h"
#include "engine/scene/splat_moves.h"

namespace darb {

namespace edits {

// "The selection" is of splats that are seen: neither deleted nor hidden, nor of a hidden layer.

struct Select {
    Selector what;
    Combine how = Combine::replace;
};
struct Invert {};
/// Deletes these splats, without them the selection. others: deletes all but these.
struct Remove {
    std::optional<Selector> what;
    bool others = false;
};
/// Hides the selection; it is still saved.
struct Hide {};
/// Shows all that is hidden, but for layers.
struct Show {};
/// Moves a layer; without a layer the selection, and everything where nothing is selected.
struct Transform {
    Similarity by;
    std::string layer;
};
/// Adds a scene as a layer, which is then selected. name: empty for that of the file.
struct Add {
    std::filesystem::path file;
    std::string name;
};
/// Adds a copy of a layer, or of the selection, as a layer, which is then selected.
struct Duplicate {
    std::string layer;  // empty: the selection
    std::string name;   // of the copy; empty: NAME copy
};
struct ShowLayer {
    std::string layer;
    bool visible = true;
};
struct RenameLayer {
    std::string layer, name;
};
/// Moves a layer in the list of layers, which is the order in which splats are saved.
struct PlaceLayer {
    std::string layer;
    std::size_t place = 0;  // counted from 0
};
struct RemoveLayer {
    std::string layer;
};
/// Makes one layer of two, which must have one kernel.
struct MergeLayers {
    std::string layer, with;
};
/// How long a world unit is, in metres; 0: not known.
struct StateUnit {
    double metres_per_unit = 0;
};
/// Which way is up: the scene is saved so that it becomes -y. Nothing: as it was opened.
struct StateGround {
    std::optional<glm::dvec3> up;  // unit vector
};

}  // namespace edits

using EditOperation =
    std::variant<edits::Select, edits::Invert, edits::Remove, edits::Hide, edits::Show,
                 edits::Transform, edits::Add, edits::Duplicate, edits::ShowLayer,
                 edits::RenameLayer, edits::PlaceLayer, edits::RemoveLayer, edits::MergeLayers,
                 edits::StateUnit, edits::StateGround>;

}  // namespace darb
