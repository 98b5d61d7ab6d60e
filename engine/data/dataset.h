// Dataset: photos with their cameras and the sparse points, from any of the supported sources.
// Cameras are pinholes in the frame of engine/scene/camera.h, at the size the photos load with;
// with DatasetOptions::original_lens or original_where_wide those of distorted photos have the lens
// before them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/data/hold_out.h"
#include "engine/scene/camera.h"

namespace darb {

/// Brown-Conrady, fisheye, ... : the camera models of COLMAP that Lens knows, as declared.
struct LensModel {
    std::string model = "PINHOLE";   // COLMAP's name
    std::vector<double> parameters;  // in COLMAP's order, px at full size
    int width = 0, height = 0;       // px at full size
    bool distorted() const;
};

struct View {
    std::string name;             // as the source names it, with folders
    std::filesystem::path photo;  // the file
    std::filesystem::path mask;   // empty where there is none; 8-bit, 0 = ignore; of the photo as
                                  // stored or as its EXIF turns it, at any size
    std::filesystem::path depth;  // measured, empty where there is none; see engine/data/depths.h
    double depth_unit = 0;        // metres a step of its values; 0: as the type of the file says
    bool depth_unit_of_integers = false;  // depth_unit is that of integers, not of floats
    double crop_radius = 0;  // px of the lens; what is farther from the middle is left out; 0: no
    Camera camera;           // of the photo as load_photo returns it
    LensModel lens;          // of the file on disk, turned by orientation; see load_photo
    bool is_test = false;    // held out
    bool in_arc = false;     // of the arc of HoldOut, is_test as well
    int orientation = 1;     // EXIF number that load_photo applies, 1 = as stored
    std::uint32_t source_id = 0;  // COLMAP's image id
};

struct PointCloud {
    std::vector<double> position;      // [P][3] world
    std::vector<std::uint8_t> colour;  // [P][3]
    // Views that saw point p: seen_by[seen_begin[p]] up to seen_by[seen_begin[p + 1]], indices into
    // Dataset::views without repeats (image ids while a COLMAP model is read). Both are empty where
    // the source does not say.
    std::vector<std::size_t> seen_begin;  // [P + 1]
    std::vector<std::uint32_t> seen_by;
    // [seen_by][2] where in the photo, as shares of its width and height, of the photo as its lens
    // declares it; empty where the source does not say. NaN: not known.
    std::vector<float> seen_at;
    // Of points on surfaces, as engine/stereo finds them; else empty.
    std::vector<float> normal;   // [P][3] world, length 1, towards the cameras
    std::vector<float> spacing;  // [P] world units, to the next points on the surface
    std::size_t size() const { return colour.size() / 3; }
    bool has_tracks() const { return !seen_by.empty() && seen_at.size() == 2 * seen_by.size(); }
};

struct DatasetOptions {
    std::string images_folder = "images";  // COLMAP: images, images_2, ...
    int resolution =
        -1;  // 1, 2, 4, 8: divisor; > 8: width in px; -1: as is, but at most 1,600 wide
    bool hold_out = false;  // --eval: what held_out says is test; sources with a test file of
                            // their own use that in either case
    HoldOut held_out{};     // --hold-out
    std::optional<double> depth_scale{};  // world units a metre; absent: find_depth_scale
    bool require_photos = true;           // false: cameras only (render)
    bool original_lens = false;  // true: distorted photos stay so, and their cameras have the lens
    bool original_where_wide = false;  // true: so do those of too_wide_to_undistort
};

/// What photo_detail() finds.
struct PhotoDetail {
    double per_pixel = 0;  // mean of |4 g - its four neighbours|, g the grey value, 0 to 1
    double opaque = 0;     // share of the pixels that are opaque, as are their four neighbours; 0:
                           // nothing is known
};

struct Dataset {
    std::filesystem::path root;
    DatasetOptions options;          // that it was loaded with
    std::string source;              // "COLMAP binary", "COLMAP text", "transforms.json", ...
    std::vector<View> views;         // by name, ascending
    PointCloud points;               // may be empty
    PointCloud start;                // what training starts from in place of points; may be empty
    bool has_alpha = false;          // some photo has an alpha channel, a mask or a frame with gaps
    double depth_scale = 1;          // of the views' depths: world units a metre
    PhotoDetail detail;              // of its views, or none: not measured
    bool alpha_is_mask = false;      // some of it comes from masks or gaps: pixels to leave out
    std::vector<std::string> notes;  // what was skipped, scaled or dropped, a sentence each
};

/// DATASET is a COLMAP project folder (sparse/0, sparse, 0, colmap/sparse/0, or the model files
/// themselves), the folder of its photos, a folder with transforms_train.json, transforms.json or
/// transforms_test.json (which is all test), or a .json path. Where both
/// are there, the COLMAP model is read, unless it cannot be, as where its photos are missing, or is
/// that of nerfstudio and the file has masks, a split or a choice of photos that it lacks; a note
/// says which. Throws Error naming file and record.
Dataset load_dataset(const std::filesystem::path& path, const DatasetOptions& options = {});

/// The COLMAP project beside whose sparse this folder of photos lies; empty where there is none.
std::filesystem::path project_of_photos(const std::filesystem::path& folder);

/// The photo, RGBA with straight alpha (255 where the file has none; a mask multiplies alpha),
/// turned by view.orientation, undistorted, box filtered to view.camera's size. Thread-safe.
///
/// EXIF: the declared camera decides. Cameras are calibrated on pixels; where the declared width
/// and height are those of the stored pixels, these stay as they are (COLMAP 3.8 and most trainers
/// ignore EXIF); where they are those of the turned photo, or none are declared, the photo is
/// turned. Undistortion: the pinhole keeps the focal lengths and covers the largest rectangle of
/// the frame without gaps, at most 60 degrees to each side; pixels no photo pixel maps to have
/// alpha 0.
ImageU8 load_photo(const View& view);

/// The views that are held out, in their order.
std::vector<View> held_out_views(const std::vector<View>& views);

/// The same views at `scale` times their size; load_photo follows. Whole photos where they are that
/// size but for the half pixel that rounding took from the view's. Throws Error where a photo is
/// smaller.
std::vector<View> scaled_views(std::vector<View> views, double scale);

/// Whether no photo of them is too small for scaled_views.
bool photos_reach(const std::vector<View>& views, double scale);

/// Loads all, on `threads` threads (0 = all cores), in the order of views. As many at a time as
/// take half of `memory` (bytes; 0: what is free) while they are read. Throws Error, before it
/// reads the first, where all of them or one take more than that.
std::vector<ImageU8> load_photos(const std::vector<View>& views, int threads = 0,
                                 std::uint64_t memory = 0);

/// What of the photos to train on teaches nothing or less than it seems, a sentence each: photos
/// that are transparent or masked everywhere, black, or the same as others, and one photo alone.
/// photos: of dataset.views, as load_photos returns them. Throws Error where every one of them is
/// transparent or masked everywhere.
std::vector<std::string> photo_doubts(const Dataset& dataset, const std::vector<ImageU8>& photos);

/// How much of the photos' opaque part is detail: of eight training photos, evenly picked, or all
/// of fewer, at the size of their views. Throws Error as load_photo.
PhotoDetail photo_detail(const std::vector<View>& views);

/// scene extent of 3DGS: 1.1 x the largest distance of a training camera from their mean centre.
/// Where that says nothing, as one camera or several in one place stand there: the median distance
/// to the points, and 1 where there are none.
double scene_extent(const Dataset& dataset);
/// What no splat need be larger than: the extent or, where photos are from nearly one place and it
/// is small, half the median distance to the points.
double scene_reach(const Dataset& dataset);
/// For each view the distance from its camera to the nearest points, a hundredth of them aside; 0
/// where there are no points.
std::vector<double> nearest_points(const Dataset& dataset);

}  // namespace darb
