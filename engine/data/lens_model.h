// SPDX-License-Identifier: MIT
// Lens: the camera models of COLMAP 3.8 and the equidistant, division and unified ones of later
// versions, as one function of a ray and its inverse.
// Every model is a pinhole after a distortion of the plane z = 1,
//   w' = v + tangential (p1, p2) + thin prism (s1, s2),
//   v = w (1 + k1 r^2 + .. + k6 r^12) / (1 + d1 r^2 + d2 r^4 + d3 r^6),   r = |w|,
// with w the ray itself or, for the fisheye models, the ray at distance theta; FOV has its own
// form. RAD_TAN_THIN_PRISM_FISHEYE, Project Aria's, takes tangential and prism terms at v in place
// of w, and the prism has terms of the fourth power, too. EUCM has w = ray / (alpha sqrt(1 + beta
// r^2) + 1 - alpha), r = |ray|; DIVISION is that with alpha = 1/2 and beta = -4 k. Source:
// COLMAP 3.8, src/base/camera_models.h; Weng et al. 1992; Devernay and Faugeras 2001.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "engine/data/dataset.h"

namespace darb {

/// nerfstudio's perspective camera, which COLMAP lacks: fx fy cx cy k1 k2 p1 p2 k3 k4, with all k
/// in the numerator.
constexpr std::string_view kFourRadial = "FOUR_RADIAL";
/// COLMAP's panorama: its parameters are the width and height of the photo, and no Lens is made of
/// it. See engine/scene/panorama.h.
constexpr std::string_view kPanorama = "EQUIRECTANGULAR";
/// COLMAP's name for a model id, 0 to 17; empty for other ids.
std::string_view lens_model_name(int id);
/// The number of parameters; -1 for an unknown name.
int lens_parameter_count(std::string_view model);

/// Throws Error where the model is unknown, the parameter count is wrong, a
/// parameter is not finite, a focal length is not positive, or the size is not between 1 and
/// 100,000 px.
void check_lens(const LensModel& lens, const std::string& where);

/// Whether the lens is a fisheye (or FOV) whose photo reaches more than 60 degrees to some side.
/// Flat pictures end there (see load_photo), so that undistortion would cut off its borders.
bool too_wide_to_undistort(const LensModel& lens);

/// The lens for the same photo scaled to width x height.
LensModel scale_lens(const LensModel& lens, int width, int height);

/// A camera with the photos' size, focal lengths and principal point, without pose or distortion.
Camera pinhole_camera(const LensModel& lens);

class Lens {
  public:
    explicit Lens(const LensModel& model);  // model: has passed check_lens

    /// ray: x/z, y/z of a point before the camera. Returns px. For rays beyond the fold of the
    /// distortion (where it stops being one to one), see valid().
    glm::dvec2 project(glm::dvec2 ray) const;
    /// The inverse, by damped Newton; nothing where it does not converge to 1e-9 on this side of
    /// the fold, or the ray is 90 degrees or more off the axis.
    std::optional<glm::dvec2> unproject(glm::dvec2 pixel) const;
    bool valid(glm::dvec2 ray) const;
    /// The lens as the projection passes take it. size: of the frame, px; the rays of its border
    /// bound those at which the Jacobian is taken. Corners that no ray below 84 degrees reaches are
    /// left out.
    LensTerms terms(glm::dvec2 size) const;

    glm::dvec2 focal{1.0}, principal{0.0};  // px

  private:
    enum class Front { plane, equidistant, fov, unified };
    struct Distorted {
        glm::dvec2 value;
        glm::dmat2 jacobian;  // column major: [c][r] = d value_r / d w_c
    };
    Distorted distort(glm::dvec2 w) const;
    double find_fold() const;
    double unified_factor(double square) const;  // w over the ray of this squared length

    void add_bend(glm::dvec2 v, Distorted& to) const;

    Front front_ = Front::plane;
    bool after_ = false;  // tangential and prism act after the radial factor
    std::array<double, 6> k_{};
    std::array<double, 3> d_{};
    double p1_ = 0, p2_ = 0, s1_ = 0, s2_ = 0, high1_ = 0, high2_ = 0, omega_ = 0, alpha_ = 0,
           beta_ = 0;
    double fold_ = 0;  // largest |w| up to which distort is one to one
};

}  // namespace darb
