// SPDX-License-Identifier: MIT
// What a run will grow to, by rule: splats, intersections and the degree of colour. Nothing is
// measured here; forecast.h measures the times that belong to it.
#pragma once

#include <cstdint>

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "trainer/options/schedule.h"

namespace darb {

/// Pixels that show the scene once: of a training photo, over the share of the training photos
/// whose frame has a point of the data set, the mean over its points. Without points every photo is
/// taken to show all of the scene. Lenses are left aside.
double scene_pixels(const Dataset& dataset);
/// Pixels of a training photo, in the mean; 0 without any.
double mean_photo_pixels(const Dataset& dataset);

/// Splats at the end: by the strategy's rule of thumb.
std::uint32_t predict_splats(const Schedule& schedule, const GrowthStart& start);

/// The same for a data set on a device, whatever its memory says: within options.max_splats and
/// what the device's buffers hold. With options.region only the share of the start that lies inside
/// grows. photo_pixels: of all training photos together.
std::uint32_t wanted_splats(const Device& device, const Dataset& dataset, const Schedule& schedule,
                            std::uint64_t photo_pixels, std::uint32_t start);

/// The count that a strategy grows to where no --max-splats is given: what adc would be forecast to
/// end with from its points, or from random ones where there are none; with options.region, there.
std::uint32_t default_budget(const Dataset& dataset, const TrainOptions& options);

/// Mean count over the run; adc: where it grows evenly while density control runs.
double mean_splats(std::uint32_t start, std::uint32_t end, const Schedule& schedule);

/// The degree of colour that a run has after so many iterations, where options.probe_sh does not
/// refuse the first.
int predict_degree(const Schedule& schedule, int iterations);

/// Whether density control runs at all.
bool has_rounds(const Schedule& schedule);

/// Room that the buffers will have for the intersections of a splat, of which frames have so many
/// on average; 0: not measured.
double intersection_room(double intersections_per_splat);

}  // namespace darb
