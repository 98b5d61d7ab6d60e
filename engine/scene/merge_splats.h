// Fewer splats by merging: two neighbours become one that has the sum of what they cover, their
// mean and their second moment, those first whose pictures change least. Nothing is dropped but
// what is never drawn. docs/experiments/merging.md has what it costs against dropping.
#pragma once

#include <cstddef>
#include <functional>
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

}  // namespace darb
