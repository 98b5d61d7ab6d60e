// SPDX-License-Identifier: MIT
// Changes to a whole scene: similarities, which also rotate splats and harmonics, and selections of
// splats, which keep the order of the rest.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <vector>

#include "engine/scene/sh_basis.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// world -> scale * turn * world + translation; scale > 0, turn orthogonal (a reflection where its
/// determinant is -1).
struct Similarity {
    double scale = 1;
    glm::dmat3 turn{1.0};
    glm::dvec3 translation{0.0};  // world
};

/// Transforms positions, log scales, rotations, harmonics, the unit and the place; the only error
/// is float32 rounding.
void transform_splats(const Similarity& similarity, SplatModel& model);

/// The best origin for float32 positions, given positions [N][3]. On each axis it is the median
/// where that is more than `most` times as far from 0 as half the scene's width, else 0. The width
/// is that of the middle half of the positions on their widest axis (1e4 where they are in one
/// place). The origin is rounded to that width, so that sums stay exact.
glm::dvec3 choose_origin(const std::vector<double>& positions, double most);
/// 0 where the positions [N][3] are float32 numbers, and on axes where float32 resolves 1/65,000 of
/// their width; else the result of choose_origin.
glm::dvec3 origin_for_float32(const std::vector<double>& positions);
/// positions: [N][3] world. Stores them relative to their origin_for_float32.
void set_positions(const std::vector<double>& positions, SplatModel& model);
/// World position of a splat.
glm::dvec3 position_of(const SplatModel& model, std::size_t splat);

/// A model of these splats in this order. Kernel, footprint and everything else that is not per
/// splat stay.
SplatModel pick_splats(const SplatModel& model, const std::vector<std::uint32_t>& splats);
/// Keeps the splats for which keep(i) is true; returns how many were dropped.
std::size_t keep_splats(const std::function<bool(std::size_t)>& keep, SplatModel& model);
/// Whether no parameter is NaN or infinite.
bool has_only_finite(const SplatModel& model);
/// Whether no parameter of this splat is NaN or infinite.
bool is_finite(const SplatModel& model, std::size_t splat);
/// Drops splats with a NaN or infinite parameter, after applying the rule of splat_model.h.
std::size_t drop_non_finite(SplatModel& model);
/// Whether a splat's rotation has a positive length; splats without one are never drawn.
bool has_rotation(const SplatModel& model, std::size_t splat);

/// Drops splats whose centre is outside the box, given in world units.
std::size_t crop_splats(const glm::dvec3& low, const glm::dvec3& high, SplatModel& model);
/// Drops splats with an opacity below `least`, 0 to 1.
std::size_t prune_opacity(double least, SplatModel& model);
/// Drops splats that nothing draws: from the one with the number `first` on, those of an opacity
/// below `cutoff`, the least alpha that is blended, by more than float32 may err. A picture keeps
/// its bits, as the others keep their order. Returns the count of those that went.
std::size_t drop_undrawn(double cutoff, std::size_t first, SplatModel& model);
/// Drops the bands above `degree`.
void limit_sh_degree(int degree, SplatModel& model);

/// The rotation that takes the axis named x, y, z, -x, -y or -z to -y, which is up in stored scenes
/// (y points down). It turns about x for z and -z, and about z for the others. Throws Error for
/// other names.
glm::dmat3 turn_of_up_axis(const std::string& axis);
/// Rotates about x, then y, then z; degrees, right-handed.
glm::dmat3 turn_of_degrees(const glm::dvec3& degrees);

// Rotation and reflection of spherical harmonics: gives the coefficients of the transformed scene.

/// The coefficients of band l = 1..degree transform by band[l][j][k], 2l+1 rows and columns.
using ShRotation = std::array<std::array<std::array<double, 7>, 7>, kMaxShDegree + 1>;

/// For an orthogonal matrix (determinant 1 or -1): the new coefficients give in direction turn * d
/// the colour that the old ones give in direction d. Accurate to 1e-14.
ShRotation sh_rotation(const glm::dmat3& turn);

/// sh_rest: [N][C-1][3] as in SplatModel, degree 0 to 3.
void rotate_sh(const ShRotation& rotation, int degree, std::vector<float>& sh_rest);

}  // namespace darb
