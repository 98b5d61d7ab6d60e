#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "engine/core/error.h"
#include "engine/data/image_io.h"
#include "engine/data/lens_model.h"
#include "engine/data/resample.h"
#include "engine/data/source.h"

namespace darb {

namespace {

constexpr int kDefaultWidth = 1600;  // px; wider photos are scaled down unless asked for

/// What happened to how many photos, for the notes.
struct Tally {
    bool own_alpha = false;  // some photo has an alpha channel of its own
    bool masked = false;     // some photo has a mask, or a gap after it was straightened
    std::size_t resized = 0, unturned = 0, undistorted = 0, too_wide = 0, downscaled = 0;
    std::size_t narrower = 0;  // photos, than the width that is asked for
    std::string resize_example;
    std::size_t unfit = 0;  // photos that cannot be used, where only cameras are wanted
    std::string unfit_example;
    std::size_t other_focal = 0;  // cameras whose focal length is not what EXIF says
    std::string focal_example;
};

bool same_aspect(const LensModel& lens, int width, int height) {
    const double wanted = static_cast<double>(width) * lens.height / lens.width;
    return std::abs(height - wanted) <= 1.5 + 0.01 * wanted;
}

/// The EXIF number to apply; see load_photo.
int choose_orientation(const ImageInfo& info, const LensModel& lens) {
    if (info.orientation < 5)
        return 1;  // no change of size: cameras are calibrated on stored pixels
    if (info.width == lens.width && info.height == lens.height) return 1;
    if (info.height == lens.width && info.width == lens.height) return info.orientation;
    return same_aspect(lens, info.width, info.height) ? 1 : info.orientation;
}

/// EXIF's focal length against the camera's. Crops and digital zoom change it, so only what is far
/// off is told; a fisheye's says little.
void compare_focal(const ImageInfo& info, const View& view, Tally& tally) {
    constexpr double kFilmDiagonal = 43.27, kMost = 1.6;  // mm
    if (info.focal_35mm <= 0 || view.lens.parameters.empty() || view.lens.width < 1 ||
        view.lens.model.find("FISHEYE") != std::string::npos)
        return;
    const double said = info.focal_35mm / kFilmDiagonal * std::hypot(info.width, info.height) *
                        view.lens.width / (view.orientation >= 5 ? info.height : info.width);
    const double ratio = view.lens.parameters[0] / said;
    if (ratio < kMost && ratio > 1 / kMost) return;
    if (tally.other_focal++ == 0)
        tally.focal_example =
            fmt::format("{} with {:.0f} px, where its EXIF's {} mm (on 35 mm film) are {:.0f} px",
                        view.name, view.lens.parameters[0], info.focal_35mm, said);
}

void fit_lens(View& view, Tally& tally) {
    const ImageInfo info = read_image_info(view.photo);
    const bool own_alpha = info.channels == 2 || info.channels == 4;
    tally.own_alpha |= own_alpha;
    tally.masked |= !view.mask.empty() || view.crop_radius > 0;
    if (view.orientation == 1) view.orientation = choose_orientation(info, view.lens);
    if (view.orientation != info.orientation) ++tally.unturned;
    compare_focal(info, view, tally);
    const bool swap = view.orientation >= 5;
    const int width = swap ? info.height : info.width, height = swap ? info.width : info.height;
    if (width == view.lens.width && height == view.lens.height) return;
    if (!same_aspect(view.lens, width, height))
        throw Error(view.photo.string(),
                    fmt::format("is {} x {} px, but its camera declares {} x {}: another aspect "
                                "ratio",
                                width, height, view.lens.width, view.lens.height),
                    "Use the photos that the cameras were calibrated with.");
    if (tally.resized++ == 0)
        tally.resize_example =
            fmt::format("{} is {} x {} px where its camera declares {} x {}", view.name, width,
                        height, view.lens.width, view.lens.height);
    view.crop_radius *= static_cast<double>(width) / view.lens.width;
    view.lens = scale_lens(view.lens, width, height);
}

/// Where only cameras are wanted: a photo that is there has its say, one that cannot be used not.
void fit_lens_if_possible(View& view, Tally& tally) {
    if (!std::filesystem::is_regular_file(view.photo)) return;
    View fitted = view;
    try {
        fit_lens(fitted, tally);
    } catch (const Error& error) {
        if (tally.unfit++ == 0)
            tally.unfit_example = fmt::format("{} {}", error.where, error.reason);
        return;
    }
    view = std::move(fitted);
}

/// The intrinsics of a picture of another size of what `full` sees.
void set_size(const Camera& full, const PhotoSize& size, Camera& camera) {
    const double sx = static_cast<double>(size.width) / full.width;
    const double sy = static_cast<double>(size.height) / full.height;
    camera.fx = full.fx * sx;
    camera.fy = full.fy * sy;
    camera.cx = full.cx * sx;
    camera.cy = full.cy * sy;
    camera.width = size.width;
    camera.height = size.height;
}

void set_intrinsics(View& view, const UndistortedFrame& frame, int resolution, Tally& tally) {
    const Camera& full = frame.camera;
    const PhotoSize size = size_at_resolution(full.width, full.height, resolution);
    if (size.width != full.width || size.height != full.height) ++tally.downscaled;
    if (resolution > std::max(full.width, 8)) ++tally.narrower;
    set_size(full, size, view.camera);
    view.camera.lens = full.lens;
}

/// The photo as it is, with its lens before the pinhole.
UndistortedFrame original_frame(const LensModel& model) {
    UndistortedFrame frame;
    frame.camera = pinhole_camera(model);
    if (model.distorted())
        frame.camera.lens = Lens(model).terms(glm::dvec2(model.width, model.height));
    return frame;
}

void add_notes(const Tally& tally, const DatasetOptions& options, Dataset& dataset) {
    if (tally.resized > 0)
        dataset.notes.push_back(fmt::format("The intrinsics of {} were scaled to the photos: {}.",
                                            counted(tally.resized, "camera"),
                                            tally.resize_example));
    if (tally.other_focal > 0)
        dataset.notes.push_back(fmt::format(
            "Warning: focal lengths are far from what the photos' EXIF says: {}, as {}. The "
            "cameras' are used.",
            counted(tally.other_focal, "camera"), tally.focal_example));
    if (tally.unfit > 0)
        dataset.notes.push_back(
            fmt::format("Kept at the size that is declared: {}, as its photo cannot be used: {}.",
                        counted(tally.unfit, "camera"), tally.unfit_example));
    if (tally.unturned > 0)
        dataset.notes.push_back(
            fmt::format("Kept as stored in spite of an EXIF rotation, as calibrated: {}.",
                        counted(tally.unturned, "photo")));
    if (tally.own_alpha && tally.masked)
        dataset.notes.push_back(
            "There are alpha channels beside masks, or beside gaps in straightened photos: "
            "transparent pixels are left out like masked ones, not taken for background.");
    if (tally.undistorted > 0)
        dataset.notes.push_back(
            fmt::format("Undistorted at load: {}.", counted(tally.undistorted, "photo")));
    if (tally.too_wide > 0)
        dataset.notes.push_back(
            fmt::format("Kept with their fisheye lens, too wide for flat pictures: {}.",
                        counted(tally.too_wide, "photo")));
    if (tally.downscaled > 0 && options.resolution == -1)
        dataset.notes.push_back(
            fmt::format("Scaled down at load: {} wider than {} px; -r 1 keeps the size.",
                        counted(tally.downscaled, "photo"), kDefaultWidth));
    if (tally.narrower > 0)
        dataset.notes.push_back(fmt::format("-r {} is wider than {}: kept at their own size.",
                                            options.resolution, counted(tally.narrower, "photo")));
}

}  // namespace

std::string counted(std::size_t count, const char* noun) {
    return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

PhotoSize size_at_resolution(int width, int height, int resolution) {
    const auto at_width = [&](int target) {  // truncates as 3DGS does
        const double scale = static_cast<double>(width) / target;
        return PhotoSize{target, std::max(1, static_cast<int>(height / scale))};
    };
    if (resolution == -1)
        return width > kDefaultWidth ? at_width(kDefaultWidth) : PhotoSize{width, height};
    if (resolution >= 1 && resolution <= 8)
        return {
            std::max(1, static_cast<int>(std::lround(static_cast<double>(width) / resolution))),
            std::max(1, static_cast<int>(std::lround(static_cast<double>(height) / resolution)))};
    if (resolution > 8) return resolution < width ? at_width(resolution) : PhotoSize{width, height};
    throw Error("resolution", fmt::format("{} is no valid value", resolution),
                "Use 1, 2, 4 or 8 (a divisor), a width in pixels above 8, or -1.");
}

namespace {

// As the photo is, its lens taken off where the view's is.
Camera whole_camera(const View& view) {
    return view.camera.lens.active || !view.lens.distorted()
               ? pinhole_camera(view.lens)
               : undistorted_frame(view.lens, view.name).camera;
}

bool is_too_small(const Camera& whole, const Camera& now, double scale) {
    return scale != 1 &&
           scale * now.width >= whole.width + 0.5 + 0.5 * scale;  // half a pixel of what it is now
}

}  // namespace

bool photos_reach(const std::vector<View>& views, double scale) {
    return std::ranges::none_of(views, [&](const View& view) {
        return is_too_small(whole_camera(view), view.camera, scale);
    });
}

std::vector<View> scaled_views(std::vector<View> views, double scale) {
    if (scale == 1) return views;
    for (View& view : views) {
        const Camera now = view.camera, full = whole_camera(view);
        const double width = scale * now.width;
        if (is_too_small(full, now, scale))
            throw Error(view.name,
                        fmt::format("is {} px wide, and {} times {} px is {:.0f} px", full.width,
                                    scale, now.width, width),
                        "Leave that scale out, or name a smaller -r.");
        PhotoSize size{full.width, full.height};
        if (width < full.width - 0.5 - 0.5 * scale) {
            size.width = std::max(1, static_cast<int>(std::lround(width)));
            size.height = std::max(
                1, static_cast<int>(std::lround(double(full.height) * size.width / full.width)));
        }
        set_size(now, size, view.camera);
    }
    return views;
}

void fit_views(Dataset& dataset, const DatasetOptions& options) {
    Tally tally;
    // Many views share one lens: its frame is found once.
    std::map<std::pair<std::string, std::vector<double>>, UndistortedFrame> frames;
    for (View& view : dataset.views) {
        if (options.require_photos)
            fit_lens(view, tally);
        else
            fit_lens_if_possible(view, tally);
        std::vector<double> key = view.lens.parameters;
        key.insert(key.end(), {double(view.lens.width), double(view.lens.height)});
        const auto [at, is_new] = frames.try_emplace({view.lens.model, std::move(key)});
        const bool kept_as_wide = !options.original_lens && options.original_where_wide &&
                                  too_wide_to_undistort(view.lens);
        const bool original = options.original_lens || kept_as_wide;
        if (is_new)
            at->second =
                original ? original_frame(view.lens) : undistorted_frame(view.lens, view.name);
        tally.masked |= at->second.has_gaps;
        if (kept_as_wide) ++tally.too_wide;
        if (view.lens.distorted() && !original) ++tally.undistorted;
        set_intrinsics(view, at->second, options.resolution, tally);
    }
    // A masked pixel must never be trained as background. An alpha channel may be opaque
    // throughout; where it is not, its transparent pixels are left out beside masked ones.
    dataset.has_alpha = tally.own_alpha || tally.masked;
    dataset.alpha_is_mask = tally.masked;
    add_notes(tally, options, dataset);
}

}  // namespace darb
