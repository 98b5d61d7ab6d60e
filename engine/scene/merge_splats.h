// Fewer splats by merging: two neighbours become one that has the sum of what they cover, their
// mean and their second moment, those first whose pictures change least. Nothing is dropped but
// what is never drawn. docs/experiments/merging.md has what it costs against dropping.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <glm/glm.hpp>
#include <vector>

#include "engine/scene/splat_model.h"

namespace darb {

struct MergeOptions {
    std::size_t threads = 0;  // 0: as many as the machine has; the result is the same bits
    /// Neighbours are those along a curve through the scene alone, and what is left comes in its
    /// order: a fraction of the time, and pictures farther off.
    bool quick = false;
    /// Called by the caller's thread with a share of the work, 0 to 1, several times a second; may
    /// throw to stop.
    std::function<void(double share)> progress = {};
};

/// min(count, N) splats; the model itself where it has no more than that. Of each merge are kept,
/// to rounding: opacity times area, mean, covariance (the kernel's second moment and the spread of
/// the means), harmonics weighted by opacity times area. Only a splat that would be more than
/// opaque has less, and is larger (splat_moments.h). Order, origin, kernel, footprint and antialias
/// stay; splats that are not touched keep their bits. Throws Error for count 0 and for arrays of a
/// wrong length.
SplatModel merge_splats(const SplatModel& model, std::size_t count,
                        const MergeOptions& options = {});

/// A model of min(count, N) splats for each count, each merged from the one before; counts fall.
/// Takes the time of the last.
std::vector<SplatModel> merge_levels(const SplatModel& model,
                                     const std::vector<std::size_t>& counts,
                                     const MergeOptions& options = {});

// What merging keeps of a splat, in double: mass, mean and covariance, and what it costs to replace
// two splats by one. Place: below merge_splats.

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
