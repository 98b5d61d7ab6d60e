// SPDX-License-Identifier: MIT
// Navigation: where a viewer's camera is and how mouse and keys move it. It is pure mathematics,
// without a window. The frame is that of Camera: x right, y down, z forward.
#pragma once

#include <glm/glm.hpp>
#include <string>

#include "engine/scene/camera.h"

namespace darb {

struct Navigation {
    glm::dvec3 eye{0, 0, -3};  // world
    glm::dmat3 axes{1.0};      // columns: the camera's right, down and forward in the world
    glm::dvec3 up{0, -1, 0};   // unit vector, world; orbits turn around it
    double distance = 3;       // world, from the eye to the pivot in front of it
    double fov_y = glm::radians(50.0);  // rad, full height
    double centre_x = 0.5;              // share of the window's width left of the optical axis
    double centre_y = 0.5;              // share of its height above that

    glm::dvec3 right() const { return axes[0]; }
    glm::dvec3 down() const { return axes[1]; }
    glm::dvec3 forward() const { return axes[2]; }
    glm::dvec3 pivot() const { return eye + distance * forward(); }

    /// Orbits the pivot. to_right turns around `up` so that the scene follows the hand; to_down
    /// tilts and stops one degree before the poles. Radians.
    void orbit(double to_right, double to_down);
    /// Turns the head while the eye stays. Radians.
    void look(double to_right, double to_down);
    /// Shifts the eye so that what is at the pivot's depth follows the pointer. dx and dy are
    /// pixels of a window of this height.
    void pan(double dx_px, double dy_px, int height_px);
    /// Multiplies the distance to the pivot by factor > 0; the pivot stays.
    void zoom(double factor);
    /// Moves along the camera's right, up and forward, in world units: W goes where one looks.
    void fly(const glm::dvec3& right_up_forward);
    /// Frames the sphere so that it fills the smaller side of a window; direction and horizon stay.
    void frame(const glm::dvec3& centre, double radius, double aspect);
    /// Looks at the centre from this distance; direction and horizon stay.
    void look_from(const glm::dvec3& centre, double distance);
    /// Sets a new pivot in the direction of `point`; the camera does not turn, only the distance
    /// changes.
    void set_pivot_depth(const glm::dvec3& point);
    /// Sets a new world up. The camera turns along with it around the pivot, so that it still looks
    /// as far above or below the horizon, which becomes level.
    void set_up(const glm::dvec3& new_up);
    /// Removes roll: right becomes perpendicular to up.
    void level();
    /// Takes pose and field of view from a photo's camera.
    void take(const Camera& camera);
    /// Looks at the pivot from this direction, a unit vector away from it; the distance stays.
    /// Where it is that of `up` or its opposite, the view is off it by 0.006 degrees, so that it
    /// has a right side, which is as near as can be to the one before.
    void view_from(const glm::dvec3& direction);
    /// The pinhole camera for a window, with its principal point at centre_x of the width and
    /// centre_y of the height.
    Camera camera(int width_px, int height_px) const;

  private:
    void turn(double to_right, double to_down);
};

/// The name of the axis nearest to a direction.
std::string up_name(const glm::dvec3& up);

}  // namespace darb
