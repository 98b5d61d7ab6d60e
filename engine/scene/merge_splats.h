// SPDX-License-Identifier: MIT
// Reduces the number of splats by merging: two neighbours become one with the sum of their
// coverage, their mean and their second moment; pairs whose merging changes pictures least go
// first. Only splats that are never drawn are dropped. docs/experiments/merging.md compares its
// cost with that of dropping.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <glm/glm.hpp>
#include <vector>

#include "engine/scene/splat_model.h"

namespace darb {

struct MergeOptions {
    std::size_t threads = 0;  // 0: as many as the machine has; the result does not depend on it
    /// Looks for neighbours only along a curve through the scene, and returns the splats in that
    /// order: takes a fraction of the time, but pictures differ more.
    bool quick = false;
    /// Called on the caller's thread with the share of the work done, 0 to 1, several times a
    /// second. It may throw to stop.
    std::function<void(double share)> progress = {};
};

/// Returns min(count, N) splats; the model itself where it has no more than that. A merge keeps, to
/// rounding, opacity times area, mean, covariance (the kernel's second moment and the spread of the
/// means), and the mean of the harmonics weighted by opacity times area. Only where the result
/// would be more than opaque does it get less of that product, and become larger (set_moments).
/// Order, origin, kernel, footprint and antialias stay; splats that are not merged keep their bits.
/// Throws Error for count 0 and for arrays with wrong lengths.
SplatModel merge_splats(const SplatModel& model, std::size_t count,
                        const MergeOptions& options = {});

/// One model of min(count, N) splats for each count, merged from the one before; counts must fall.
/// Takes as long as the last model alone.
std::vector<SplatModel> merge_levels(const SplatModel& model,
                                     const std::vector<std::size_t>& counts,
                                     const MergeOptions& options = {});

// What merging keeps of a splat, in double: mass, mean and covariance; and the cost of replacing
// two splats by one. Internal to merge_splats.

/// xx xy xz yy yz zz.
using Symmetric3 = std::array<double, 6>;

struct SplatMoments {
    glm::dvec3 mean{0.0};     // relative to SplatModel::origin
    Symmetric3 covariance{};  // as the splat's scales and rotation give it, world^2
    double mass = 0;          // opacity x area; the opacity may exceed 1 until it is written
    glm::dvec3 colour{0.0};   // colour of the constant harmonic, [0, 1]; used for the cost only
};

/// Root mean square, over all directions, of the projected ellipse's area over pi: sqrt((minor_xy +
/// minor_yz + minor_zx) / 3), with the minors of the covariance.
double mean_area(const Symmetric3& covariance);

/// Log scales beyond LOG_SCALE_LIMIT are clamped to it, as when drawn. The splat must satisfy
/// has_rotation.
SplatMoments moments_of(const SplatModel& model, std::size_t splat);

/// The splat with the sum of both masses, their common mean, and the second moment about it: the
/// weighted mean of both covariances plus, divided by second_moment (see rendered_second_moment),
/// the spread of both means. share_of_b: b's share of the mass; half where there is no mass.
SplatMoments merge_moments(const SplatMoments& a, const SplatMoments& b, double second_moment,
                           double* share_of_b = nullptr);

/// Squared error, in pictures from along the three axes, of replacing a and b by `merged`, with
/// Gaussians of equal moments on an empty background, summed over red, green, blue and opacity;
/// world^2. Never NaN.
double merge_error(const SplatMoments& a, const SplatMoments& b, const SplatMoments& merged,
                   double second_moment);

/// Writes position, scales, rotation and opacity of the splat. Where mass / area exceeds 0.99, it
/// is written with opacity 0.99 and an area that is (mass / area / 0.99)^0.4 times as large.
void set_moments(const SplatMoments& moments, std::size_t splat, SplatModel& model);

}  // namespace darb
