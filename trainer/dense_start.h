// A dense start: points with normals that stereo finds on the surfaces (engine/stereo), and what of
// the data set's own points lies beside them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/stereo/surface_points.h"

namespace darb {

struct DenseStart {
    PointCloud cloud;  // those on surfaces first, then the data set's, whose spacing is 0
    std::size_t on_surfaces = 0;
    double agreeing = 0;  // share of the photos' pixels whose depth several photos agree on
    double seconds = 0;
    std::vector<std::string> names;  // of the photos' views
    std::vector<StereoPhoto> photos;
    std::vector<PlaneMap> maps;
    std::vector<ImageU8> consistent;  // [H][W] of a photo: 255 where others agree
};

/// photos: as load_photos gives them, of every view.
DenseStart dense_start(Device& device, const Dataset& dataset, const std::vector<ImageU8>& photos,
                       std::uint64_t seed);

/// FOLDER/points.ply (x y z, nx ny nz, red green blue) and for each photo NAME.png: the photo, its
/// depths from near (yellow) to far (blue), and those of them that other photos agree on.
void write_dense_start(const DenseStart& start, const std::filesystem::path& folder);

}  // namespace darb
