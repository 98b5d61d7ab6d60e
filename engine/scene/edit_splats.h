// Changes to a whole scene: similarities with their effect on rotations and harmonics, and choices
// of splats; those that drop some keep the order of the others.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <vector>

#include "engine/scene/splat_model.h"

namespace darb {

/// world -> scale * turn * world + translation; scale > 0, turn orthogonal (a reflection where its
/// determinant is -1).
struct Similarity {
    double scale = 1;
    glm::dmat3 turn{1.0};
    glm::dvec3 translation{0.0};  // world
};

/// Positions, log scales, rotations and harmonics; float32 rounding alone.
void transform_splats(const Similarity& similarity, SplatModel& model);

/// What float32 positions are best counted from, for positions [N][3]: by axis, the median where it
/// is more than `most` times as far from 0 as half of the width that the middle half of the
/// positions takes on its widest axis (1e4 where they are in one place); else 0. Rounded to that
/// width, so that sums stay exact.
glm::dvec3 choose_origin(const std::vector<double>& positions, double most);
/// 0 where positions [N][3] are float32 numbers, and on axes where float32 resolves 1/65,000 of
/// their width; else choose_origin's.
glm::dvec3 origin_for_float32(const std::vector<double>& positions);
/// positions: [N][3] world, to be counted from their origin_for_float32.
void set_positions(const std::vector<double>& positions, SplatModel& model);
/// World position of a splat.
glm::dvec3 position_of(const SplatModel& model, std::size_t splat);

/// These splats in this order; kernel, footprint and all else that is not per splat stays.
SplatModel pick_splats(const SplatModel& model, const std::vector<std::uint32_t>& splats);
/// Keeps the splats for which keep(i) is true; returns the count of those that went.
std::size_t keep_splats(const std::function<bool(std::size_t)>& keep, SplatModel& model);
/// Whether no parameter is NaN or infinite.
bool has_only_finite(const SplatModel& model);
/// Whether none of this splat is.
bool is_finite(const SplatModel& model, std::size_t splat);
/// Drops splats with a NaN or infinite parameter, after the rule of infinite_values.h.
std::size_t drop_non_finite(SplatModel& model);
/// Whether a splat's rotation has a length; one without is never drawn.
bool has_rotation(const SplatModel& model, std::size_t splat);
/// Drops splats whose centre is outside the box, world.
std::size_t crop_splats(const glm::dvec3& low, const glm::dvec3& high, SplatModel& model);
/// Drops splats of lower opacity (of the sigmoid, 0 to 1).
std::size_t prune_opacity(double least, SplatModel& model);
/// Drops splats that nothing draws: from the one with the number `first` on, those of an opacity
/// below `cutoff`, the least alpha that is blended, by more than float32 may err. A picture keeps
/// its bits, as the others keep their order. Returns the count of those that went.
std::size_t drop_undrawn(double cutoff, std::size_t first, SplatModel& model);
/// Leaves out the bands above `degree`.
void limit_sh_degree(int degree, SplatModel& model);

/// The turn that takes the axis named x, y, z, -x, -y or -z to -y, which is up in scenes as they
/// are stored (y down): about x for z and -z, about z for the others. Throws Error for other names.
glm::dmat3 turn_of_up_axis(const std::string& axis);
/// About x, then y, then z; degrees, right-handed.
glm::dmat3 turn_of_degrees(const glm::dvec3& degrees);

}  // namespace darb
