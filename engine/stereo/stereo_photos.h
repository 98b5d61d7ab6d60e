// What stereo compares: the training photos in grey at a small size, the others that each is
// compared with, and how far away a thing in it may be.
#pragma once

#include <vector>

#include "engine/data/dataset.h"

namespace darb {

struct StereoPhoto {
    std::size_t view = 0;                // of the data set
    Camera camera;                       // at the size of grey
    ImageF grey;                         // in [0, 1]; below 0: no photo, or nothing that is opaque
    ImageU8 rgba;                        // at the same size
    double near = 0, far = 0;            // depths, world units
    std::vector<std::uint32_t> sources;  // of the photos beside it, the best first
};

struct StereoOptions {
    int longest_side = 400;  // px, of the photos as they are compared; smaller ones stay
    std::uint32_t sources = 4;
};

/// photos: as load_photos gives them, of every view. Views that are held out, or have a lens before
/// them, are left out. Sources: where most of what the photo shows is seen under angles of about 12
/// degrees, none where no other photo shows it. Depths: of the points that the view sees, with a
/// margin; without points through region_in_view.
std::vector<StereoPhoto> stereo_photos(const Dataset& dataset, const std::vector<ImageU8>& photos,
                                       const StereoOptions& options);

}  // namespace darb
