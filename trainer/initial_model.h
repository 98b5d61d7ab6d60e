// The splats that training starts from: one at each point of the cloud, or random ones where the
// cameras look.
#pragma once

#include "engine/data/point_splats.h"
#include "engine/scene/splat_model.h"
#include "trainer/options.h"

namespace darb {

/// Scale: root mean square distance to the 3 nearest neighbours, squared distance at least 1e-7;
/// times Schedule::initial_scale and length_scale; rotation identity; opacity a hair above
/// Schedule::initial_opacity; colour of the point. Without points: random colours and positions in
/// the cube around the point that the optical axes come closest to, as wide as the photos show
/// there, or in the box of the cameras where the axes are parallel. The model's origin is set where
/// coordinates are large. Of more points than options.max_splats a drawn part.
///
/// Points with a spacing lie on surfaces: their splats are flat along the normal and as wide as the
/// points are apart.
SplatModel initial_model(const Dataset& dataset, const TrainOptions& options);
/// Whether it starts from random points: there are none, or options.start says so.
bool starts_random(const Dataset& dataset, const TrainOptions& options);
/// The points that its splats come from: the data set's, those of a dense start, or as many as are
/// drawn.
std::uint64_t start_points(const Dataset& dataset, const TrainOptions& options);
/// Its number of splats.
std::uint32_t initial_count(const Dataset& dataset, const TrainOptions& options);

}  // namespace darb
