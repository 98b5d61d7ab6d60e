// What merging keeps of a splat, in double: mass, mean and covariance, and what it costs to replace
// two splats by one. Place: below merge_splats.
#pragma once

#include <array>
#include <cstddef>
#include <glm/glm.hpp>

#include "engine/scene/splat_model.h"

namespace darb {

/// xx xy xz yy yz zz.
using Symmetric3 = std::array<double, 6>;

struct SplatMoments {
    glm::dvec3 mean{0.0};     // from SplatModel::origin
    Symmetric3 covariance{};  // as the splat's scales and rotation give it, world^2
    double mass = 0;          // opacity x area; opacity may pass 1 until it is written
    glm::dvec3 colour{0.0};   // [0, 1] of the constant harmonic, for the cost alone
};

/// Root mean square over all directions of the projected ellipse's area over pi:
/// sqrt((minor_xy + minor_yz + minor_zx) / 3), the minors those of the covariance.
double mean_area(const Symmetric3& covariance);

/// Log scales beyond LOG_SCALE_LIMIT count as that, as they are drawn. Not for splats that
/// has_rotation denies.
SplatMoments moments_of(const SplatModel& model, std::size_t splat);

/// The one splat with the sum of both masses, their mean, and their second moment about it: the
/// mean of both covariances and, divided by second_moment (of rendered_second_moment), the spread
/// of both means. share_of_b: b's share of the mass, half where there is none.
SplatMoments merge_moments(const SplatMoments& a, const SplatMoments& b, double second_moment,
                           double* share_of_b = nullptr);

/// Squared error that pictures from along the three axes get where a and b become `merged`, with
/// Gaussians of the same moments on an empty background, summed over red, green, blue and opacity;
/// world^2. Never NaN.
double merge_error(const SplatMoments& a, const SplatMoments& b, const SplatMoments& merged,
                   double second_moment);

/// Writes position, scales, rotation and opacity of the splat. Where mass / area is more than 0.99
/// it is drawn with 0.99 and an area that is (mass / area / 0.99)^0.4 as large.
void set_moments(const SplatMoments& moments, std::size_t splat, SplatModel& model);

}  // namespace darb
