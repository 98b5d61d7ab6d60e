// SPDX-License-Identifier: MIT
// Dataset: photos with their cameras and the sparse points, from any of the supported sources.
// Cameras are pinholes in the frame of engine/scene/camera.h, at the size the photos load with.
// With DatasetOptions::original_lens or original_where_wide, the cameras of distorted photos
// include the lens.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/data/hold_out.h"
#include "engine/scene/camera.h"
#include "engine/scene/earth_place.h"

namespace darb {

/// A lens as the source declares it, by one of COLMAP's camera models that Lens knows
/// (Brown-Conrady, fisheye, ...).
struct LensModel {
    std::string model = "PINHOLE";   // COLMAP's name
    std::vector<double> parameters;  // in COLMAP's order, px at full size; empty: of a
                                     // camera that took no photo
    int width = 0, height = 0;       // px at full size
    bool distorted() const;
    /// EQUIRECTANGULAR: the photo shows all directions, and a view of it is one face of a cube.
    bool panorama() const;
};

struct View {
    std::string name;             // as the source names it, including folders
    std::filesystem::path photo;  // path of the file
    std::filesystem::path mask;  // empty where there is none; 8-bit, 0 = ignore; made for the photo
                                 // as stored or as its EXIF turns it, at any size
    std::filesystem::path depth;  // measured; empty where there is none; see engine/data/depths.h
    double depth_unit = 0;  // metres per step of the depth file; 0: as the type of the file says
    bool depth_unit_of_integers = false;  // depth_unit applies to integers only, not to floats
    double crop_radius = 0;  // px: what lies farther from the middle of the lens's image is left
                             // out; 0: nothing is
    Camera camera;           // for the photo as load_photo returns it
    LensModel lens;          // for the file on disk, turned by orientation; see load_photo
    bool is_test = false;    // held out
    bool in_arc = false;     // in the arc of HoldOut; is_test is set as well
    int face = -1;           // of cube_faces(), where the photo is a panorama; else -1
    int orientation = 1;     // EXIF orientation that load_photo applies; 1 = as stored
    std::uint32_t source_id = 0;  // COLMAP's image id
};

struct PointCloud {
    std::vector<double> position;      // [P][3] world
    std::vector<std::uint8_t> colour;  // [P][3]
    // The views that saw point p are seen_by[seen_begin[p]] up to seen_by[seen_begin[p + 1]]:
    // indices into Dataset::views without repeats (image ids while a COLMAP model is being read).
    // Both are empty where the source does not say.
    std::vector<std::size_t> seen_begin;  // [P + 1]
    std::vector<std::uint32_t> seen_by;
    // [seen_by][2]: where in the photo the point was seen, as shares of the photo's width and
    // height, before undistortion. NaN where unknown; empty where the source does not say.
    std::vector<float> seen_at;
    // The next two are known for points on surfaces, as engine/stereo finds them; otherwise they
    // are empty.
    std::vector<float> normal;   // [P][3] world, length 1, towards the cameras
    std::vector<float> spacing;  // [P] distance to the next points on the surface, world units
    std::size_t size() const { return colour.size() / 3; }
    bool has_tracks() const { return !seen_by.empty() && seen_at.size() == 2 * seen_by.size(); }
};

struct DatasetOptions {
    std::string images_folder = "images";  // COLMAP: images, images_2, ...
    int resolution =
        -1;  // 1, 2, 4, 8: divisor; > 8: width in px; -1: as stored, but at most 1,600 wide
    bool hold_out = false;  // --eval: hold out the views that held_out names; a source with a test
                            // file of its own uses that file in either case
    HoldOut held_out{};     // --hold-out
    std::optional<double> depth_scale{};  // world units a metre; absent: find_depth_scale
    bool require_photos = true;           // false: cameras only (render)
    bool original_lens = false;           // leave photos distorted, and give cameras the lens
    bool original_where_wide = false;     // do so only for lenses that are too_wide_to_undistort
    bool whole_panoramas = false;  // cameras only: a view a panorama, without face and intrinsics
};

/// The result of photo_detail().
struct PhotoDetail {
    double per_pixel = 0;  // mean |4 g - sum of g of four neighbours|, g: grey, 0 to 1
    double opaque = 0;  // share of the pixels that are opaque and have four opaque neighbours; 0:
                        // nothing is known
};

struct Dataset {
    std::filesystem::path root;
    DatasetOptions options;   // what it was loaded with
    std::string source;       // "COLMAP binary", "COLMAP text", "transforms.json", ...
    std::vector<View> views;  // ascending by name
    PointCloud points;        // may be empty
    PointCloud start;         // training starts from these instead of points, unless empty
    bool has_alpha = false;   // some photo has an alpha channel, a mask, or gaps from undistortion
    double depth_scale = 1;   // world units a metre, for the measured depths
    double metres_per_unit =
        0;               // how long a world unit is, by GPS or measured depths; 0: not known
    EarthPlace place;    // where the scene lies on earth, by GPS
    PhotoDetail detail;  // detail of the photos; 0 where it was not measured
    bool alpha_is_mask = false;      // some alpha comes from masks or gaps: pixels to leave out
    std::vector<std::string> notes;  // what was skipped, scaled or dropped, one sentence each
};

/// path: a COLMAP project folder (with sparse/0, sparse, 0, colmap/sparse/0, or the model files
/// themselves), the folder of its photos, a folder with transforms_train.json, transforms.json or
/// transforms_test.json (whose views are all held out), or a .json path. Where there are both a
/// COLMAP model and a transforms file, the model is read, unless it cannot be (its photos may be
/// missing) or it is nerfstudio's and the transforms file has masks, a split or a choice of photos
/// that it lacks; a note says which was read. Throws Error naming file and record.
Dataset load_dataset(const std::filesystem::path& path, const DatasetOptions& options = {});

/// The COLMAP project whose photos this folder holds, found by the sparse folder beside it; empty
/// where there is none.
std::filesystem::path project_of_photos(const std::filesystem::path& folder);

/// The photo as RGBA with straight alpha (255 where the file has none; a mask multiplies alpha),
/// turned by view.orientation, undistorted, and box filtered to view.camera's size. Thread-safe.
///
/// EXIF: the declared camera decides, because cameras are calibrated on pixels. Where the declared
/// width and height match the stored pixels, these stay as they are (COLMAP 3.8 and most trainers
/// ignore EXIF); where they match the turned photo, or none are declared, the photo is turned.
/// Undistortion: the pinhole keeps the focal lengths and covers the largest rectangle of the frame
/// without gaps, at most 60 degrees to each side; pixels that no pixel of the photo maps to have
/// alpha 0.
ImageU8 load_photo(const View& view);

/// The views that are held out, in their original order.
std::vector<View> held_out_views(const std::vector<View>& views);

/// The views at `scale` times their size, for load_photo to follow. Where the photo has that size,
/// apart from the half pixel that rounding took from the view, it is used whole. Throws Error where
/// a photo is smaller.
std::vector<View> scaled_views(std::vector<View> views, double scale);

/// Whether every photo is large enough for scaled_views.
bool photos_reach(const std::vector<View>& views, double scale);

/// Loads all photos on `threads` threads (0 = all cores), in the order of views. At any time, the
/// photos being read take at most half of `memory` (bytes; 0: the free memory). Throws Error before
/// reading the first where all of them together, or a single one, would take more than `memory`.
std::vector<ImageU8> load_photos(const std::vector<View>& views, int threads = 0,
                                 std::uint64_t memory = 0);

/// Warnings about training photos that teach nothing, or less than they seem to, one sentence each:
/// photos that are black, transparent or masked everywhere, or equal to others, and a single photo.
/// photos: those of dataset.views, as load_photos returns them. Throws Error where every photo is
/// transparent or masked everywhere.
std::vector<std::string> photo_doubts(const Dataset& dataset, const std::vector<ImageU8>& photos);

/// How much detail the opaque part of the photos has, measured on eight evenly picked training
/// photos (or all, where there are fewer) at the size of their views. Throws Error as load_photo
/// does.
PhotoDetail photo_detail(const std::vector<View>& views);

/// The scene extent of 3DGS: 1.1 x the largest distance of a training camera from their mean
/// centre. Where that is meaningless, because there is one camera or all stand in one place, the
/// median distance to the points, or 1 where there are none.
double scene_extent(const Dataset& dataset);
/// The size beyond which no splat need grow: the extent or, where the photos were taken from nearly
/// one place and the extent is small, half the median distance to the points.
double scene_reach(const Dataset& dataset);
/// For each view, the distance from its camera to the nearest points, leaving the nearest hundredth
/// aside; 0 where there are no points.
std::vector<double> nearest_points(const Dataset& dataset);

/// A box around what the cameras of a data set look at.
struct WatchedBox {
    glm::dvec3 centre;  // world
    glm::dvec3 half;    // half the lengths of the sides, world units
};

/// The cube around the point that the optical axes of the training views come closest to, as wide
/// as the photos show there; where the axes are parallel, the bounding box of the cameras.
WatchedBox region_in_view(const Dataset& dataset);

/// Takes the points of a PLY or LAS file in place of the data set's, with a note; which photos saw
/// the former is forgotten. Throws Error naming the file where it has none, or where no camera has
/// any of them in its picture.
void replace_points(const std::filesystem::path& file, Dataset& dataset);

}  // namespace darb
