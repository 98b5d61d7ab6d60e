// Gizmo: handles on the screen by which a selection is moved, turned or scaled. Pure mathematics;
// axes are those of the world, px those of the camera.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "engine/scene/camera.h"
#include "engine/scene/edit_splats.h"

namespace darb {

enum class GizmoMode { move, turn, scale };

/// Where it is and how large, px from its centre to the end of an axis or to a ring.
struct Gizmo {
    GizmoMode mode = GizmoMode::move;
    glm::dvec3 centre{0.0};  // world
    double size_px = 90;
};

/// Lines of one handle in the world, axis 0 to 2; of the scale there is one handle, 0, a circle
/// that faces the camera.
std::vector<glm::dvec3> handle_lines(const Gizmo& gizmo, const Camera& camera, int axis);
/// The handle within a ninth of the size of a pixel, the nearest; none where there is none.
std::optional<int> handle_at(const Gizmo& gizmo, const Camera& camera, const glm::dvec2& px);
/// What a drag of the handle from one pixel to another asks for; nothing where that cannot be said
/// (an axis that points at the eye).
Similarity dragged(const Gizmo& gizmo, const Camera& camera, int handle, const glm::dvec2& from,
                   const glm::dvec2& to);
/// A similarity that leaves `centre` where it is, then shifts.
Similarity about(const glm::dvec3& centre, double scale, const glm::dmat3& turn,
                 const glm::dvec3& shift = glm::dvec3(0.0));

}  // namespace darb
