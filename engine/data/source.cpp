// SPDX-License-Identifier: MIT
#include "engine/data/source.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/quantile.h"
#include "engine/data/image_io.h"
#include "engine/data/lens_model.h"
#include "engine/data/point_cloud_ply.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/stored_units.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

constexpr const char* kExtensions[] = {".png", ".jpg", ".jpeg", ".PNG", ".JPG", ".JPEG"};

fs::path with_any_extension(const fs::path& path) {
    const bool is_there = fs::is_regular_file(path);
    if (is_there && !is_foreign_picture_name(path)) return path;
    const std::string stem = without_picture_extension(path).string();
    for (const char* extension : kExtensions)
        if (fs::path candidate = stem + extension; fs::is_regular_file(candidate)) return candidate;
    return is_there ? path : fs::path();
}

}  // namespace

fs::path tidy_path(const fs::path& path) {
    const fs::path tidy = path.lexically_normal();
    return tidy.has_filename() || tidy == tidy.root_path() ? tidy : tidy.parent_path();
}

std::string with_slashes(std::string name) {
    std::replace(name.begin(), name.end(), '\\', '/');
    return name;
}

std::string scaled_images(const fs::path& folder) {
    std::string first;
    std::error_code none;  // a missing folder has no entries
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, none)) {
        const std::string name = entry.path().filename().string();
        if (name.starts_with("images_") && entry.is_directory() && (first.empty() || name < first))
            first = name;
    }
    return first;
}

fs::path find_by_end(const fs::path& folder, const std::string& name) {
    std::string rest = with_slashes(name);
    for (std::size_t slash = rest.find('/'); slash != std::string::npos; slash = rest.find('/')) {
        rest.erase(0, slash + 1);
        if (rest.empty() || rest.starts_with("..")) continue;
        if (fs::path found = with_any_extension(folder / rest); !found.empty()) return found;
    }
    return {};
}

std::string lower_case(std::string text) {
    std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
    return text;
}

std::vector<fs::path> folders_of(const fs::path& parent) {
    std::vector<fs::path> folders;
    std::error_code none;  // a missing folder has no entries
    for (const fs::directory_entry& entry : fs::directory_iterator(parent, none))
        if (entry.is_directory(none) && !entry.path().filename().string().starts_with('.'))
            folders.push_back(entry.path());
    std::sort(folders.begin(), folders.end());
    return folders;
}

std::string unused_folders(const std::vector<fs::path>& parents,
                           std::initializer_list<std::string_view> words) {
    std::set<fs::path> seen;
    std::string list;
    for (const fs::path& parent : parents)
        for (const fs::path& folder : folders_of(parent)) {
            const std::string name = lower_case(folder.filename().string());
            if (std::ranges::none_of(words, [&](std::string_view word) {
                    return name.find(word) != std::string::npos;
                }))
                continue;
            std::error_code none;
            std::size_t files = 0;
            fs::path first;
            for (const auto& entry : fs::recursive_directory_iterator(folder, none)) {
                if (!entry.is_regular_file(none)) continue;
                if (files++ == 0 || entry.path() < first) first = entry.path();
            }
            if (files == 0 || !seen.insert(fs::absolute(folder).lexically_normal()).second)
                continue;
            list += fmt::format("{}{} ({}, the first being {})", list.empty() ? "" : "; ",
                                folder.string(), counted(files, "file"),
                                first.lexically_relative(folder).string());
        }
    return list;
}

fs::path find_photo(const fs::path& folder, const std::string& name) {
    fs::path found = with_any_extension(folder / name);
    if (found.empty() && name.find('\\') != std::string::npos)
        found = with_any_extension(folder / with_slashes(name));
    return found;
}

namespace {

constexpr int kDefaultWidth = 1600;  // px; wider photos are scaled down unless asked for

/// How many photos were changed in which way, for the notes.
struct Tally {
    bool own_alpha = false;  // some photo has an alpha channel of its own
    bool masked = false;     // some photo has a mask, or a gap from undistortion
    std::size_t resized = 0, unturned = 0, undistorted = 0, too_wide = 0, downscaled = 0;
    std::size_t panoramas = 0;  // photos that were cut into faces
    std::size_t narrower = 0;   // photos narrower than the requested width
    std::string resize_example;
    std::size_t unfit = 0;  // photos that cannot be used, where only cameras are wanted
    std::string unfit_example;
    std::size_t other_focal = 0;  // cameras whose focal length differs from EXIF
    std::string focal_example;
};

bool same_aspect(const LensModel& lens, int width, int height) {
    const double wanted = static_cast<double>(width) * lens.height / lens.width;
    return std::abs(height - wanted) <= 1.5 + 0.01 * wanted;
}

/// The EXIF orientation to apply; see load_photo.
int choose_orientation(const ImageInfo& info, const LensModel& lens) {
    if (info.orientation < 5)
        return 1;  // the size does not tell: cameras are calibrated on stored pixels
    if (info.width == lens.width && info.height == lens.height) return 1;
    if (info.height == lens.width && info.width == lens.height) return info.orientation;
    return same_aspect(lens, info.width, info.height) ? 1 : info.orientation;
}

/// Compares EXIF's focal length with the camera's. Crops and digital zoom change it, so only large
/// differences are noted; that of a fisheye says little.
void compare_focal(const ImageInfo& info, const View& view, Tally& tally) {
    constexpr double kFilmDiagonal = 43.27, kMost = 1.6;  // mm
    if (info.focal_35mm <= 0 || view.lens.parameters.empty() || view.lens.width < 1 ||
        view.lens.model.find("FISHEYE") != std::string::npos || view.lens.panorama())
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

/// For when only cameras are wanted: an existing photo is taken into account, and one that cannot
/// be used is ignored.
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

/// Sets the intrinsics for a picture of another size that shows what `full` sees.
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
    if (tally.panoramas > 0)
        dataset.notes.push_back(fmt::format("Cut into the six faces of a cube at load: {}.",
                                            counted(tally.panoramas, "panorama")));
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

// The camera at the photo's full size, without the lens if the view's camera has none.
Camera whole_camera(const View& view) {
    return view.camera.lens.active || !view.lens.distorted()
               ? pinhole_camera(view.lens)
               : undistorted_frame(view.lens, view.name).camera;
}

bool is_too_small(const Camera& whole, const Camera& now, double scale) {
    return scale != 1 &&
           scale * now.width >=
               whole.width + 0.5 + 0.5 * scale;  // less than half a pixel more than it is now
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
    // Many views share one lens, so its frame is computed only once.
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
        const bool original = (options.original_lens || kept_as_wide) && !view.lens.panorama();
        if (is_new)
            at->second =
                original ? original_frame(view.lens) : undistorted_frame(view.lens, view.name);
        tally.masked |= at->second.has_gaps;
        if (kept_as_wide) ++tally.too_wide;
        if (view.lens.panorama()) {
            tally.panoramas += view.face == 0 ? 1 : 0;
        } else if (view.lens.distorted() && !original) {
            ++tally.undistorted;
        }
        set_intrinsics(view, at->second, options.resolution, tally);
        if (view.lens.panorama() && view.face < 0) {
            view.camera.width = view.lens.width;
            view.camera.height = view.lens.height;
        }
    }
    // A masked pixel must never be trained as background. Where a data set has both masks and an
    // alpha channel with transparent pixels, these are left out as well.
    dataset.has_alpha = tally.own_alpha || tally.masked;
    dataset.alpha_is_mask = tally.masked;
    add_notes(tally, options, dataset);
}

// Cameras and points that cannot give a good result. A few wrong ones among many are common: most
// are noted, and cameras that stand far outside the scene are left out.

namespace {

constexpr double kLeastFocal = 0.05,
                 kMostFocal = 50;        // shares of the larger side: 169 and 1.1 degrees
constexpr double kMostAspect = 4;        // ratio of the two focal lengths
constexpr double kMostShift = 1;         // principal point beyond the frame, as a share of its side
constexpr std::size_t kFewPoints = 100;  // so few may well be out of a good camera's view
constexpr std::size_t kLooked = 20'000;  // points, evenly picked

// A camera that stands this many times farther out than the others may be wrong. The limit is
// higher where no points tell what it sees: an overview from far away is not a mistake.
constexpr double kFarWithPoints = 10, kFarWithoutPoints = 100;
constexpr double kLeastCore = 2.0 / 3;  // share of the cameras that stand together
constexpr double kShareOfDepth = 0.1;  // share of the distance to the points: cameras that stand in
                                       // one place are treated as at least this far apart
constexpr double kLeastSpread = 0.05;  // share of the frame that the points must cover
constexpr std::size_t kLeastGroup = 3;    // as many cameras elsewhere are a second place, not
                                          // mistakes
constexpr std::size_t kNamedCameras = 3;  // photos named in a note

/// A number of views, and the first of them.
struct Found {
    std::size_t count = 0;
    const View* example = nullptr;
    void add(const View& view) {
        if (count++ == 0) example = &view;
    }
};

bool has_odd_focal_length(const Camera& c) {
    const double side = std::max(c.width, c.height);
    const auto odd = [&](double f) { return !(f >= kLeastFocal * side && f <= kMostFocal * side); };
    return odd(c.fx) || odd(c.fy) || c.fx > kMostAspect * c.fy || c.fy > kMostAspect * c.fx;
}

bool has_odd_principal_point(const Camera& c) {
    const auto odd = [](double p, double side) {
        return !(p >= -kMostShift * side && p <= (1 + kMostShift) * side);
    };
    return odd(c.cx, c.width) || odd(c.cy, c.height);
}

/// Whether a point is before the camera and in its frame, or beside it by up to half the frame;
/// with a lens, whether one is before it.
bool sees_a_point(const Camera& c, const PointCloud& points, std::size_t step) {
    for (std::size_t i = 0; i < points.size(); i += step) {
        const double* at = &points.position[3 * i];
        const glm::dvec3 p = c.rotation * glm::dvec3(at[0], at[1], at[2]) + c.translation;
        if (!(p.z > 0)) continue;
        if (c.lens.active) return true;
        const double x = (c.fx * p.x / p.z + c.cx) / c.width;
        const double y = (c.fy * p.y / p.z + c.cy) / c.height;
        if (x > -0.5 && x < 1.5 && y > -0.5 && y < 1.5) return true;
    }
    return false;
}

double middle(std::vector<double> values, double share = 0.5) {
    const auto nth = values.begin() +
                     static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), nth, values.end());
    return *nth;
}

glm::dvec3 middle_of(const std::vector<glm::dvec3>& places) {
    glm::dvec3 centre;
    std::vector<double> values(places.size());
    for (int axis = 0; axis < 3; ++axis) {
        for (std::size_t i = 0; i < places.size(); ++i) values[i] = places[i][axis];
        centre[axis] = middle(values);
    }
    return centre;
}

std::vector<glm::dvec3> some_points(const PointCloud& points) {
    std::vector<glm::dvec3> some;
    for (std::size_t i = 0; i < points.size(); i += points.size() / kLooked + 1)
        some.emplace_back(points.position[3 * i], points.position[3 * i + 1],
                          points.position[3 * i + 2]);
    return some;
}

/// How much of the frame the visible points cover: the middle 90 % of them, as a share of the
/// frame's longer side. Nothing where the view sees hardly any.
std::optional<double> spread_in_frame(const View& view, const std::vector<glm::dvec3>& points) {
    const double side = std::max(view.lens.width, view.lens.height);
    const double focal = view.lens.parameters.empty() ? side : view.lens.parameters[0];
    std::vector<double> u, v;
    for (const glm::dvec3& point : points) {
        const glm::dvec3 p = view.camera.rotation * point + view.camera.translation;
        if (!(p.z > 0)) continue;
        const double x = focal * p.x / (p.z * side), y = focal * p.y / (p.z * side);
        if (std::abs(x) > 1 || std::abs(y) > 1) continue;
        u.push_back(x);
        v.push_back(y);
    }
    if (u.size() < points.size() / 100 + 2) return {};
    return std::max(middle(u, 0.95) - middle(u, 0.05), middle(v, 0.95) - middle(v, 0.05));
}

/// Whether this camera has company: other cameras about as close together as those of the core, but
/// not in one place. That holds for drones above a street or a second room, but not for mistakes.
bool is_of_a_group(const std::vector<glm::dvec3>& centres, std::size_t i, double reach) {
    std::size_t near = 0;
    double farthest = 0;
    for (const glm::dvec3& other : centres) {
        const double away = glm::distance(centres[i], other);
        if (away > reach) continue;
        ++near;
        farthest = std::max(farthest, away);
    }
    return near >= kLeastGroup && farthest > 1e-6 * reach;
}

/// Which views stand far outside the place where at least two thirds of them are. `times`: how many
/// radii of that place the nearest of them is away.
std::vector<std::size_t> far_views(const Dataset& dataset, double& times) {
    const std::size_t count = dataset.views.size();
    if (count < 3) return {};
    std::vector<glm::dvec3> centres;
    for (const View& view : dataset.views) centres.push_back(view.camera.centre());
    const glm::dvec3 centre = middle_of(centres);
    std::vector<double> away;
    for (const glm::dvec3& c : centres) away.push_back(glm::distance(c, centre));
    std::vector<double> sorted = away;
    std::sort(sorted.begin(), sorted.end());
    const bool has_points = dataset.points.size() >= kFewPoints;
    std::vector<glm::dvec3> points;
    double least = 0;
    if (has_points) {
        points = some_points(dataset.points);
        std::vector<double> depths;
        for (const glm::dvec3& point : points) depths.push_back(glm::distance(point, centre));
        least = kShareOfDepth * middle(depths);
    }
    const double limit = has_points ? kFarWithPoints : kFarWithoutPoints;
    auto core = static_cast<std::size_t>(std::ceil(kLeastCore * static_cast<double>(count))) - 1;
    const auto radius = [&] { return std::max(sorted[core], least); };
    while (core + 1 < count && !(sorted[core + 1] > limit * radius())) ++core;
    if (core + 1 >= count || !(radius() > 0)) return {};
    std::vector<std::size_t> far;
    for (std::size_t v = 0; v < count; ++v) {
        if (away[v] <= sorted[core]) continue;
        if (is_of_a_group(centres, v, 2 * radius())) continue;
        if (spread_in_frame(dataset.views[v], points).value_or(0) >= kLeastSpread) continue;
        times = far.empty() ? away[v] / radius() : std::min(times, away[v] / radius());
        far.push_back(v);
    }
    return far;
}

}  // namespace

void leave_out_far_cameras(Dataset& dataset) {
    double times = 0;
    const std::vector<std::size_t> far = far_views(dataset, times);
    if (far.empty()) return;
    std::string names;
    for (std::size_t i = 0; i < std::min(far.size(), kNamedCameras); ++i)
        names += (i > 0 ? ", " : "") + dataset.views[far[i]].name;
    if (far.size() > kNamedCameras) names += ", ...";
    const bool leaves_out = dataset.options.require_photos, one = far.size() == 1;
    const std::string which = one ? fmt::format("the camera of {}", names)
                                  : fmt::format("the cameras of {} of {} photos ({})", far.size(),
                                                dataset.views.size(), names);
    const std::string where =
        fmt::format("at least {:.0f} times as far from the middle of the cameras as the others do",
                    std::floor(times));
    dataset.notes.push_back(
        leaves_out
            ? fmt::format("Warning: {} {} left out, as {} {}, which only a wrong pose explains. "
                          "Correct {} to use {}.",
                          which, one ? "was" : "were", one ? "it stands" : "they stand", where,
                          one ? "its pose" : "their poses", one ? "the photo" : "the photos")
            : fmt::format("Warning: {} {} {}, which only a wrong pose explains.", which,
                          one ? "stands" : "stand", where));
    if (!leaves_out) return;
    for (std::size_t i = far.size(); i-- > 0;)
        dataset.views.erase(dataset.views.begin() + static_cast<std::ptrdiff_t>(far[i]));
}

void note_coarse_points(Dataset& dataset) {
    const std::vector<double>& positions = dataset.points.position;
    constexpr double kFar = 256;  // a cloud this many widths from 0 may be coarse in float32
    if (positions.size() < 3 * kFewPoints || choose_origin(positions, kFar) == glm::dvec3(0.0))
        return;
    double step = 0;
    std::vector<double> places(positions.size() / 3);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        for (std::size_t i = 0; i < places.size(); ++i)
            places[i] = std::abs(positions[3 * i + axis]);
        const double own = float32_step(nearest_rank(places, 0.5));
        if (own > step && were_float32(places)) step = own;
    }
    std::vector<double> distance2 = neighbour_distance2(positions);
    const double distance = std::sqrt(nearest_rank(distance2, 0.5));
    constexpr double kCoarsePoints = 0.1;  // share of the distance to the next points
    if (!(step > kCoarsePoints * distance)) return;
    dataset.notes.push_back(fmt::format(
        "Warning: the points lie in steps of {:.3g}, as float32 does so far from 0, and half of "
        "them are within {:.3g} of their neighbours: they were rounded when they were written. "
        "Export them with x, y and z as double, or cameras and points moved to 0.",
        step, distance));
}

void note_odd_cameras(Dataset& dataset) {
    Found focal, principal, blind;
    const std::size_t step = dataset.points.size() / kLooked + 1;
    for (const View& view : dataset.views) {
        if (has_odd_focal_length(view.camera)) focal.add(view);
        if (has_odd_principal_point(view.camera)) principal.add(view);
        if (dataset.points.size() >= kFewPoints && !sees_a_point(view.camera, dataset.points, step))
            blind.add(view);
    }
    std::vector<std::string>& notes = dataset.notes;
    if (focal.count > 0) {
        const Camera& c = focal.example->camera;
        notes.push_back(fmt::format(
            "Warning: focal lengths beyond reason: {}, as {} with {:g} and {:g} px for {} x {} px.",
            counted(focal.count, "camera"), focal.example->name, c.fx, c.fy, c.width, c.height));
    }
    if (principal.count > 0) {
        const Camera& c = principal.example->camera;
        notes.push_back(
            fmt::format("Warning: principal points far outside of the photo: {}, as {} with {:g}, "
                        "{:g} for {} x {} px.",
                        counted(principal.count, "camera"), principal.example->name, c.cx, c.cy,
                        c.width, c.height));
    }
    if (blind.count > 0)
        notes.push_back(fmt::format(
            "Warning: none of the points is in view: {} of {}, as {}. Points and cameras may be of "
            "different reconstructions.",
            counted(blind.count, "camera"), dataset.views.size(), blind.example->name));
}

void replace_points(const fs::path& file, Dataset& dataset) {
    std::size_t dropped = 0;
    const std::size_t own = dataset.points.size();
    dataset.points = read_point_cloud(file, dropped, &dataset.notes);
    const PointCloud& points = dataset.points;
    if (points.size() == 0)
        throw Error(file.string(), "has no points to start from", "Name another file.");
    const std::size_t step = points.size() / kLooked + 1;
    if (std::ranges::none_of(dataset.views, [&](const View& view) {
            return sees_a_point(view.camera, points, step);
        }))
        throw Error(
            file.string(),
            fmt::format("none of its {} points is in the picture of any camera", points.size()),
            "Name points in the coordinates of the data set's cameras.");
    dataset.notes.push_back(
        fmt::format("Training starts from {} of {}, in place of the data set's "
                    "{}.",
                    counted(points.size(), "point"), file.string(), own));
    if (dropped > 0)
        dataset.notes.push_back(
            fmt::format("{} with NaN, infinity or marked as withheld were dropped.",
                        counted(dropped, "point")));
}

}  // namespace darb
