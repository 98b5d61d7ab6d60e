// SPDX-License-Identifier: MIT
// The splats that training starts from: one at each point of the cloud, or random ones where the
// cameras look.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/data/point_cloud_ply.h"
#include "engine/gpu/device.h"
#include "engine/scene/splat_model.h"
#include "engine/stereo/surface_points.h"
#include "trainer/options/schedule.h"

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
SplatModel initial_model(const Dataset& dataset, const Schedule& schedule);
/// Whether it starts from random points: there are none, or options.start says so.
bool starts_random(const Dataset& dataset, const TrainOptions& options);
/// The points that its splats come from: the data set's, those of a dense start, or as many as are
/// drawn.
std::uint64_t start_points(const Dataset& dataset, const TrainOptions& options);
/// Its number of splats.
std::uint32_t initial_count(const Dataset& dataset, const TrainOptions& options);

// A dense start: points with normals that stereo finds on the surfaces (engine/stereo), and what of
// the data set's own points lies beside them.

struct DenseStart {
    PointCloud cloud;  // points on surfaces first, then the data set's, whose spacing is 0
    std::size_t on_surfaces = 0;
    double agreeing = 0;  // share of the photos' pixels whose depth several photos agree on
    double seconds = 0;
    std::vector<std::string> names;  // names of the photos' views
    std::vector<StereoPhoto> photos;
    std::vector<PlaneMap> maps;
    std::vector<ImageU8> consistent;  // [H][W] of a photo: 255 where others agree
};

/// Surfaces at fewer places say little of a scene: a run that asked for nothing starts at random
/// ones, which are never fewer unless --random-points says so.
inline constexpr std::size_t kLeastOnSurfaces = 1'000;

/// Whether a run that is not told what to start from (TrainOptions::start) asks stereo first.
bool lacks_points(const Dataset& dataset, const TrainOptions& options);

/// photos: as load_photos gives them, of every view.
DenseStart dense_start(Device& device, const Dataset& dataset, const std::vector<ImageU8>& photos,
                       std::uint64_t seed);

/// Leaves them in dataset.start where it lacks points and stereo finds enough.
void find_lacking_points(Device& device, const std::vector<ImageU8>& photos,
                         const TrainOptions& options, Dataset& dataset);

/// FOLDER/points.ply (x y z, nx ny nz, red green blue) and for each photo NAME.png: the photo, its
/// depths from near (yellow) to far (blue), and those of them that other photos agree on.
void write_dense_start(const DenseStart& start, const std::filesystem::path& folder);

}  // namespace darb
