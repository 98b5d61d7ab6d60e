// SPDX-License-Identifier: MIT
#include "engine/data/dataset.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <new>
#include <numeric>
#include <optional>
#include <sstream>
#include <system_error>
#include <utility>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/data/colmap.h"
#include "engine/data/depths.h"
#include "engine/data/gps.h"
#include "engine/data/image_io.h"
#include "engine/data/run_colmap.h"
#include "engine/data/source.h"
#include "engine/data/video.h"
#include "engine/scene/panorama.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

constexpr double kStrayPoints = 0.01;  // share of the points that may lie before the others by
                                       // mistake
constexpr size_t kPointsLookedAt = 20'000;
constexpr double kExtentMargin = 1.1;
constexpr double kLeastExtent = 1e-9;  // world units: below this, the cameras stand in one place
constexpr double kLeastShareOfDepth = 1e-3;  // share of the distance to the points: below this, too

// Reads a list of held-out photos beside a COLMAP model, one name per line, as several trainers do.
void mark_test_list(const fs::path& list, Dataset& dataset) {
    if (!fs::is_regular_file(list)) return;
    std::istringstream lines(read_text_file(list));
    std::size_t unknown = 0;
    for (std::string name; std::getline(lines, name);) {
        while (!name.empty() && (name.back() == '\r' || name.back() == ' ')) name.pop_back();
        if (name.empty()) continue;
        const auto view = std::find_if(dataset.views.begin(), dataset.views.end(),
                                       [&](const View& v) { return v.name == name; });
        if (view == dataset.views.end())
            ++unknown;
        else
            view->is_test = true;
    }
    if (unknown > 0)
        dataset.notes.push_back(fmt::format("{} names {} that the model does not hold.",
                                            list.string(), counted(unknown, "photo")));
}

Dataset load_model(const fs::path& path, const fs::path& model, const DatasetOptions& options) {
    Dataset dataset = load_colmap(path, model, options);
    mark_test_list(path / "test.txt", dataset);
    if (model != path) mark_test_list(model / "test.txt", dataset);
    return dataset;
}

// What the views of a transforms file state that those of a COLMAP model of the same photos lack;
// empty where there is nothing.
std::string what_it_adds(const Dataset& transforms, const Dataset& model) {
    const auto file = [](const fs::path& path) {
        return path.empty() ? path : fs::absolute(path).lexically_normal();
    };
    std::map<fs::path, fs::path> masks, depths;
    for (const View& view : model.views) {
        masks[file(view.photo)] = file(view.mask);
        depths[file(view.photo)] = file(view.depth);
    }
    std::size_t known = 0;
    bool masked = false, measured = false, split = false;
    for (const View& view : transforms.views) {
        const auto at = masks.find(file(view.photo));
        known += at != masks.end() ? 1 : 0;
        masked |= at != masks.end() && !view.mask.empty() && at->second != file(view.mask);
        measured |= at != masks.end() && !view.depth.empty() &&
                    depths[file(view.photo)] != file(view.depth);
        split |= view.is_test;
    }
    if (known < transforms.views.size())
        return fmt::format("that lacks {} of its {} photos", transforms.views.size() - known,
                           transforms.views.size());
    if (known < model.views.size())
        return fmt::format("it leaves out {} of the model's {} photos", model.views.size() - known,
                           model.views.size());
    return masked     ? "that lacks its masks"
           : measured ? "that lacks its depths"
           : split    ? "that lacks its split"
                      : "";
}

// How two sources differ on the cameras of the same photos, regardless of the frame and unit of
// their worlds: compares focal lengths, rotations between successive photos, and ratios of
// distances between them. Part of a sentence; empty where they agree.
std::string disagreement(const Dataset& model, const Dataset& transforms) {
    constexpr double kFocal = 0.02, kTurn = 0.02, kWay = 0.05, kMostOdd = 0.1;
    std::map<fs::path, const View*> others;
    for (const View& view : transforms.views)
        others[fs::absolute(view.photo).lexically_normal()] = &view;
    std::vector<std::pair<const View*, const View*>> shared;
    for (const View& view : model.views)
        if (const auto at = others.find(fs::absolute(view.photo).lexically_normal());
            at != others.end())
            shared.emplace_back(&view, at->second);
    for (const auto& [a, b] : shared) {
        const double one = a->lens.parameters.at(0) / a->lens.width,
                     two = b->lens.parameters.at(0) / b->lens.width;
        if (std::abs(one / two - 1) > kFocal)
            return fmt::format(
                "the focal length of {} is {:.3f} of its width in {}, and {:.3f} in {}", a->name,
                one, model.source, two, transforms.source);
    }
    std::vector<double> ratios;
    for (std::size_t i = 0; i + 1 < shared.size(); ++i) {
        const auto& [a, b] = shared[i];
        const auto& [c, d] = shared[i + 1];
        const glm::dmat3 one = c->camera.rotation * glm::transpose(a->camera.rotation),
                         two = d->camera.rotation * glm::transpose(b->camera.rotation);
        for (int k = 0; k < 3; ++k)
            if (glm::distance(one[k], two[k]) > kTurn)
                return fmt::format("the turn from {} to {} is another in {} than in {}", a->name,
                                   c->name, model.source, transforms.source);
        const double way = glm::distance(a->camera.centre(), c->camera.centre());
        if (way > 0) ratios.push_back(glm::distance(b->camera.centre(), d->camera.centre()) / way);
    }
    if (ratios.size() < 3) return {};
    std::vector<double> sorted = ratios;
    std::sort(sorted.begin(), sorted.end());
    const double usual = sorted[sorted.size() / 2];
    const auto odd = std::ranges::count_if(
        ratios, [&](double ratio) { return !(std::abs(ratio / usual - 1) <= kWay); });
    if (static_cast<double>(odd) <= kMostOdd * static_cast<double>(ratios.size())) return {};
    return fmt::format(
        "{} of {} ways from a camera to the next have another length in {} than in {}", odd,
        ratios.size(), model.source, transforms.source);
}

void note_transforms_beside(const fs::path& path, const fs::path& model,
                            const DatasetOptions& options, Dataset& dataset) {
    std::string differs;
    try {
        differs = disagreement(dataset, load_transforms(path, options));
    } catch (const Error&) {  // it cannot be read, but nobody asked for it
    }
    dataset.notes.push_back(
        differs.empty()
            ? fmt::format("{} was read; name the transforms file itself to use that.",
                          model.string())
            : fmt::format("Warning: {}. {} was read; name the transforms file itself to use that.",
                          differs, model.string()));
}

// Loads the COLMAP model that nerfstudio leaves below its transforms.json, which names the photos
// as COLMAP saw them, or the transforms.json itself. The choice depends on the photos alone, so
// that loading cameras without photos (require_photos false) gives the cameras that were trained
// on.
Dataset load_nerfstudio(const fs::path& path, const fs::path& model, DatasetOptions options) {
    const bool require_photos = std::exchange(options.require_photos, true);
    std::optional<Dataset> transforms;
    try {
        transforms = load_transforms(path, options);
    } catch (const NoRoom&) {  // this says nothing about the files
        throw;
    } catch (const Error&) {  // then the model is read, or nothing
    }
    std::string reason;
    try {
        Dataset dataset = load_model(path, model, options);
        if (transforms) reason = what_it_adds(*transforms, dataset);
        if (reason.empty()) return dataset;
    } catch (const NoRoom&) {
        throw;
    } catch (const Error& error) {
        reason = fmt::format("{} {}", error.where, error.reason);
    }
    if (!transforms) {
        options.require_photos = require_photos;
        return load_model(path, model, options);  // reports what is wrong with it
    }
    transforms->notes.push_back(
        fmt::format("{} was read in place of {}: {}.", transforms->source, model.string(), reason));
    return std::move(*transforms);
}

}  // namespace

fs::path project_of_photos(const fs::path& folder) {
    fs::path around = tidy_path(folder == "." ? fs::absolute(folder) : folder).parent_path();
    if (around.empty()) around = ".";
    if (!is_colmap_model(around / "sparse" / "0") && !is_colmap_model(around / "sparse")) return {};
    std::error_code none;
    for (const auto& entry : fs::recursive_directory_iterator(folder, none))
        if (is_photo_name(entry.path().filename().string())) return around;
    return {};
}

namespace {

// Sets options to those of the data set that was read.
Dataset load_source(const fs::path& path, DatasetOptions& options) {
    if (!fs::exists(path)) throw Error(path.string(), "does not exist", "Check the path.");
    if (!fs::is_directory(path)) {
        if (has_extension(path, ".json")) return load_transforms(path, options);
        refuse_file(path);
    }
    const bool transforms = std::ranges::any_of(
        kTransformsFiles, [&](const char* name) { return fs::exists(path / name); });
    const fs::path nerfstudio = path / "colmap" / "sparse" / "0";
    for (const fs::path& model :
         {path / "sparse" / "0", path / "sparse", path, path / "0", nerfstudio}) {
        if (!is_colmap_model(model)) continue;
        Dataset dataset = transforms && model == nerfstudio ? load_nerfstudio(path, model, options)
                                                            : load_model(path, model, options);
        if (transforms && dataset.source.starts_with("COLMAP"))
            note_transforms_beside(path, model, options, dataset);
        return dataset;
    }
    if (transforms) return load_transforms(path, options);
    if (const fs::path opensfm = path / "reconstruction.json"; fs::exists(opensfm))
        return load_transforms(opensfm, options);  // reports what the file is
    if (const fs::path project = project_of_photos(path); !project.empty()) {
        options.images_folder =
            (path == "." ? tidy_path(fs::absolute(path)) : path).filename().string();
        Dataset dataset = load_source(project, options);
        dataset.notes.push_back(fmt::format("{} was read, whose photos {} holds.",
                                            dataset.root.string(), path.string()));
        return dataset;
    }
    refuse_folder(path);
}

// Turns the image ids in the tracks into indices of the sorted views, each at most once per point.
void index_tracks(Dataset& dataset) {
    PointCloud& points = dataset.points;
    if (points.seen_by.empty()) {
        points.seen_begin.clear();
        return;
    }
    std::map<std::uint32_t, std::uint32_t> index;
    for (std::size_t i = 0; i < dataset.views.size(); ++i)
        index[dataset.views[i].source_id] = static_cast<std::uint32_t>(i);
    const bool located = points.has_tracks();
    std::vector<std::uint32_t> seen;
    std::vector<float> seen_at;
    std::vector<std::size_t> begin{0};
    std::vector<std::pair<std::uint32_t, std::size_t>> views;  // view, and its place in the track
    for (std::size_t p = 0; p + 1 < points.seen_begin.size(); ++p) {
        views.clear();
        for (std::size_t k = points.seen_begin[p]; k < points.seen_begin[p + 1]; ++k)
            if (const auto at = index.find(points.seen_by[k]); at != index.end())
                views.emplace_back(at->second, k);
        std::sort(views.begin(), views.end());
        for (std::size_t v = 0; v < views.size(); ++v) {
            if (v > 0 && views[v].first == views[v - 1].first) continue;
            seen.push_back(views[v].first);
            if (!located) continue;
            seen_at.push_back(points.seen_at[2 * views[v].second]);
            seen_at.push_back(points.seen_at[2 * views[v].second + 1]);
        }
        begin.push_back(seen.size());
    }
    points.seen_at = std::move(seen_at);
    points.seen_by = std::move(seen);
    points.seen_begin = std::move(begin);
}

// "a/room.jpg" and "up" to "a/room@up.jpg".
std::string name_of_face(const std::string& panorama, std::string_view face) {
    const fs::path name = panorama;
    return (name.parent_path() /
            fmt::format("{}@{}{}", name.stem().string(), face, name.extension().string()))
        .generic_string();
}

/// The views of a panorama by the place of its faces in the new order, or of another view by its
/// own place alone.
using PlacesOfFaces = std::array<std::uint32_t, kCubeFaces>;

// A point that a panorama sees is in view of the face that looks its way. Where in it is not known.
void move_tracks_to_faces(const std::vector<View>& before, const std::vector<PlacesOfFaces>& places,
                          PointCloud& points) {
    for (std::size_t p = 0; p + 1 < points.seen_begin.size(); ++p)
        for (std::size_t k = points.seen_begin[p]; k < points.seen_begin[p + 1]; ++k) {
            const View& view = before[points.seen_by[k]];
            const PlacesOfFaces& to = places[points.seen_by[k]];
            std::size_t face = 0;
            if (view.lens.panorama()) {
                const double* at = &points.position[3 * p];
                const glm::dvec3 ray = view.camera.rotation * glm::dvec3(at[0], at[1], at[2]) +
                                       view.camera.translation;
                const auto along = [&](const CubeFace& f) { return (f.rotation * ray).z; };
                face = static_cast<std::size_t>(std::ranges::max_element(cube_faces(), {}, along) -
                                                cube_faces().begin());
                if (points.has_tracks())
                    points.seen_at[2 * k] = points.seen_at[2 * k + 1] =
                        std::numeric_limits<float>::quiet_NaN();
            }
            points.seen_by[k] = to[face];
        }
}

// Makes six views of each panorama.
void cut_panoramas(Dataset& dataset) {
    std::vector<View> before;
    before.swap(dataset.views);
    std::size_t depths = 0;
    std::vector<std::pair<std::size_t, int>> sources;  // of the new views: view before, its face
    for (std::size_t v = 0; v < before.size(); ++v) {
        const View& view = before[v];
        if (!view.lens.panorama()) {
            dataset.views.push_back(view);
            sources.emplace_back(v, 0);
            continue;
        }
        depths += view.depth.empty() ? 0 : 1;
        for (int f = 0; f < kCubeFaces; ++f) {
            const CubeFace& face = cube_faces()[static_cast<std::size_t>(f)];
            View& of_face = dataset.views.emplace_back(view);
            of_face.face = f;
            of_face.name = name_of_face(view.name, face.name);
            of_face.depth.clear();
            of_face.camera = face_camera(view.camera, face, 1);
            sources.emplace_back(v, f);
        }
    }
    if (dataset.views.size() == before.size()) return;
    std::vector<std::uint32_t> order(dataset.views.size());
    std::iota(order.begin(), order.end(), 0U);
    std::ranges::stable_sort(order, {}, [&](std::uint32_t i) { return dataset.views[i].name; });
    std::vector<View> sorted;
    std::vector<PlacesOfFaces> places(before.size());
    for (const std::uint32_t i : order) {
        places[sources[i].first][static_cast<std::size_t>(sources[i].second)] =
            static_cast<std::uint32_t>(sorted.size());
        sorted.push_back(std::move(dataset.views[i]));
    }
    dataset.views = std::move(sorted);
    move_tracks_to_faces(before, places, dataset.points);
    if (depths > 0)
        dataset.notes.push_back(fmt::format(
            "Warning: the measured depths of {} are not read: depths are read of flat photos only.",
            counted(depths, "panorama")));
}

// The distance within which a share of the points lies, judged by every step-th point.
double distance_quantile(const PointCloud& points, const glm::dvec3& from, double share,
                         size_t step = 1) {
    std::vector<double> distance;
    for (size_t i = 0; i < points.size(); i += step)
        distance.push_back(
            glm::distance(from, glm::dvec3(points.position[3 * i], points.position[3 * i + 1],
                                           points.position[3 * i + 2])));
    const auto nth =
        distance.begin() + static_cast<std::ptrdiff_t>(double(distance.size()) * share);
    std::nth_element(distance.begin(), nth, distance.end());
    return *nth;
}

double median_distance(const PointCloud& points, const glm::dvec3& from) {
    return distance_quantile(points, from, 0.5);
}

std::vector<glm::dvec3> training_centres(const Dataset& dataset) {
    std::vector<glm::dvec3> centres;
    for (const View& view : dataset.views)
        if (!view.is_test) centres.push_back(view.camera.centre());
    return centres;
}

glm::dvec3 mean_of(const std::vector<glm::dvec3>& centres) {
    return std::accumulate(centres.begin(), centres.end(), glm::dvec3(0.0)) /
           double(centres.size());
}

}  // namespace

Dataset load_dataset(const fs::path& path, const DatasetOptions& asked) try {
    DatasetOptions options = asked;
    options.images_folder = tidy_path(asked.images_folder).generic_string();
    size_at_resolution(1, 1, options.resolution);  // rejects a bad option before anything is read
    Dataset dataset = load_source(tidy_path(path), options);
    dataset.options = options;
    std::stable_sort(dataset.views.begin(), dataset.views.end(),
                     [](const View& a, const View& b) { return a.name < b.name; });
    leave_out_far_cameras(dataset);
    index_tracks(dataset);
    if (options.hold_out)
        if (std::string note = mark_held_out(dataset.views, options.held_out); !note.empty())
            dataset.notes.push_back(std::move(note));
    if (!options.whole_panoramas) cut_panoramas(dataset);
    fit_views(dataset, options);
    note_odd_cameras(dataset);
    note_coarse_points(dataset);
    if (options.require_photos) {
        find_depth_scale(dataset);
        find_place(dataset);
    }
    return dataset;
} catch (const std::bad_alloc&) {
    throw NoRoom(path.string(), "does not fit into the memory that is left",
                 "Free memory, or use a smaller data set.");
}

std::vector<View> held_out_views(const std::vector<View>& views) {
    std::vector<View> chosen;
    for (const View& view : views)
        if (view.is_test) chosen.push_back(view);
    return chosen;
}

double scene_extent(const Dataset& dataset) {
    const std::vector<glm::dvec3> centres = training_centres(dataset);
    if (centres.empty()) return 1;
    const glm::dvec3 mean = mean_of(centres);
    double largest = 0;
    for (const glm::dvec3& centre : centres)
        largest = std::max(largest, glm::distance(mean, centre));
    const double extent = kExtentMargin * largest;
    if (dataset.points.size() == 0) return extent > kLeastExtent ? extent : 1;
    const double depth = median_distance(dataset.points, mean);
    return extent > kLeastShareOfDepth * depth ? extent : std::max(depth, kLeastExtent);
}

double scene_reach(const Dataset& dataset) {
    const double extent = scene_extent(dataset);
    const std::vector<glm::dvec3> centres = training_centres(dataset);
    if (centres.empty() || dataset.points.size() == 0) return extent;
    return std::max(extent, median_distance(dataset.points, mean_of(centres)) / 2);
}

std::vector<double> nearest_points(const Dataset& dataset) {
    std::vector<double> nearest(dataset.views.size(), 0);
    if (dataset.points.size() == 0) return nearest;
    const size_t step = dataset.points.size() / kPointsLookedAt + 1;
    for (size_t v = 0; v < nearest.size(); ++v)
        nearest[v] =
            distance_quantile(dataset.points, dataset.views[v].camera.centre(), kStrayPoints, step);
    return nearest;
}

// Input that is not a data set, and how to get one from it.

namespace fs = std::filesystem;

namespace {

std::string train_finds_cameras(const fs::path& path) {
    return fmt::format(
        "darb train finds them with COLMAP, and leaves OUT/colmap/dense as the data set:\n"
        "    darb train {} -o OUT",
        shell_quoted(path));
}

}  // namespace

void refuse_file(const fs::path& file) {
    if (is_video_name(file))
        throw Error(file.string(), "is a video, without cameras", train_finds_cameras(file));
    if (is_photo_name(file) || is_foreign_picture_name(file))
        throw Error(file.string(), "is one picture", "Name the folder of the photos.");
    throw Error(file.string(), "is neither a folder, a .json file nor a video",
                fmt::format("Name a COLMAP project, a folder of photos or with transforms.json, "
                            "that file, or a video ({}).",
                            video_extensions()));
}

void refuse_folder(const fs::path& folder) {
    fs::path video;
    std::error_code none;
    for (const fs::path& place : {folder, folder / kImages})
        for (const fs::directory_entry& entry : fs::directory_iterator(place, none)) {
            const fs::path& path = entry.path();
            if (path.filename().string().starts_with('.')) continue;
            if (is_photo_name(path) || is_foreign_picture_name(path))
                throw Error(folder.string(), "holds no cameras, but pictures",
                            train_finds_cameras(folder));
            if (is_video_name(path) && (video.empty() || path < video)) video = path;
        }
    if (!video.empty())
        throw Error(folder.string(), "holds no cameras and no photos, but a video",
                    fmt::format("Name the video: darb train {} -o OUT", shell_quoted(video)));
    throw Error(
        folder.string(),
        "holds no cameras: neither a COLMAP model (sparse/0 with cameras and images, .bin or "
        ".txt) nor transforms.json",
        "Name a data set, a folder of photos, or a video.");
}

// Least squares point of the optical axes: sum (I - d d^T) x = sum (I - d d^T) c.
WatchedBox region_in_view(const Dataset& dataset) {
    std::vector<View> views;
    for (const View& v : dataset.views)
        if (!v.is_test) views.push_back(v);
    glm::dmat3 normal(0.0);
    glm::dvec3 right(0.0), low(1e300), high(-1e300);
    for (const View& v : views) {
        const glm::dvec3 c = v.camera.centre();
        const glm::dvec3 axis = glm::transpose(v.camera.rotation)[2];
        const glm::dmat3 across = glm::dmat3(1.0) - glm::outerProduct(axis, axis);
        normal += across;
        right += across * c;
        low = glm::min(low, c);
        high = glm::max(high, c);
    }
    const double scale = static_cast<double>(views.size());
    if (std::abs(glm::determinant(normal)) > 1e-3 * scale * scale * scale) {
        const glm::dvec3 focus = glm::inverse(normal) * right;
        double half = 0.0;
        for (const View& v : views) {
            const double view_half =
                0.5 * std::min(v.camera.width / v.camera.fx, v.camera.height / v.camera.fy);
            half += glm::length(v.camera.centre() - focus) * view_half;
        }
        return {focus, glm::dvec3(half / scale)};
    }
    return {0.5 * (low + high), glm::max(0.5 * (high - low), glm::dvec3(scene_extent(dataset)))};
}

}  // namespace darb
