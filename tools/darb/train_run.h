// What the commands that train share: the effects of a run and its strategy.
#pragma once

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "tools/darb/train_flags.h"

namespace darb {

/// Plans the effects of the run and sets flags.train, flags.run and the views as it wants them.
/// Loads the photos into flags.photos where the plan has to look at them and they are not there
/// yet; sees_photos false: the plan does without.
void plan_effects(Dataset& dataset, TrainFlags& flags, bool sees_photos = true);

/// Whether splats start from points that stereo has still to find: --start dense, or auto without
/// points.
bool starts_from_stereo(const Dataset& dataset, const TrainFlags& flags);

/// Finds the points that --start asks for and leaves them in dataset.start, in flags.start_note
/// what that brought, and what writes its pictures in flags.run; after plan_effects. Where auto
/// finds too few (kLeastOnSurfaces) dataset.start stays empty. Throws Error where it asks for
/// points and there are none.
void plan_start(Device& device, Dataset& dataset, TrainFlags& flags);

/// Measures the photos' detail, which forecasts go by, and sets the count that mcmc and budget grow
/// to where none was given; after plan_effects.
void plan_strategy(Dataset& dataset, TrainFlags& flags);

}  // namespace darb
