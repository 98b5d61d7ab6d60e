// SPDX-License-Identifier: MIT
#include "engine/data/depths.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>
#include <utility>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/quantile.h"
#include "engine/data/depth_io.h"
#include "engine/data/image_io.h"
#include "engine/data/lens_model.h"
#include "engine/data/source.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

constexpr float kOneSurface = 0.05f;  // neighbours that differ by less, as a share, lie on one
                                      // surface
constexpr std::size_t kViewsForScale = 20;  // views whose depths are read to find the scale
constexpr std::size_t kLeastPoints = 20;
constexpr double kOfTheSameScene = 0.2;  // largest spread of the ratios of points to depths, as a
                                         // share

/// The stems of a name: with and without its extension, with and without images/.
std::vector<fs::path> depth_stems(const std::string& name) {
    const fs::path plain = without_images(name);
    return {plain, without_picture_extension(plain), fs::path(name),
            without_picture_extension(fs::path(name))};
}

constexpr const char* kDepthTails[] = {".png", ".PNG", ".npy", ".tif", ".TIF", ".tiff", ".TIFF"};

bool is_depth_name(const fs::path& path) {
    return is_photo_name(path) || has_extension(path, ".npy") || has_extension(path, ".tif") ||
           has_extension(path, ".tiff");
}

fs::path with_depth_tail(const std::string& stem) {
    for (const char* tail : kDepthTails)
        if (const fs::path found = stem + tail; fs::is_regular_file(found)) return found;
    return {};
}

fs::path find_depth(const fs::path& depths, const std::string& name) {
    for (const fs::path& stem : depth_stems(name))
        for (const char* word : {"", "_depth", ".depth"})
            if (fs::path found = with_depth_tail((depths / stem).string() + word); !found.empty())
                return found;
    return {};
}

/// FOLDER/depths or FOLDER/depth, ignoring case; empty where there is neither.
fs::path depths_folder(const fs::path& folder) {
    for (const char* name : {"depths", "depth"})
        if (fs::is_directory(folder / name)) return folder / name;
    for (const fs::path& other : folders_of(folder)) {
        const std::string name = lower_case(other.filename().string());
        if (name == "depths" || name == "depth") return other;
    }
    return {};
}

/// Takes NAME_depth.png and the like beside the photos. Returns how many it found.
std::size_t find_depths_beside_photos(Dataset& dataset) {
    std::size_t found = 0;
    for (View& view : dataset.views) {
        const fs::path stem = without_picture_extension(view.photo);
        for (const std::string& name : {stem.string(), view.photo.string()})
            for (const char* word : {"_depth", ".depth"})
                if (view.depth.empty() && !name.empty()) view.depth = with_depth_tail(name + word);
        found += view.depth.empty() ? 0 : 1;
    }
    return found;
}

/// Notes files that have the names of photos but a kind that cannot be read.
void note_unread_depths(const fs::path& depths, Dataset& dataset) {
    std::set<std::string> wanted;
    for (const View& view : dataset.views)
        if (view.depth.empty())
            for (const fs::path& stem : depth_stems(view.name))
                wanted.insert(stem.generic_string());
    std::size_t count = 0;
    fs::path first;
    for (const auto& entry : fs::recursive_directory_iterator(depths)) {
        fs::path stem = entry.path().lexically_relative(depths);
        if (!entry.is_regular_file() || !wanted.contains(stem.replace_extension().generic_string()))
            continue;
        if (count++ == 0 || entry.path() < first) first = entry.path();
    }
    if (count > 0)
        dataset.notes.push_back(fmt::format(
            "Warning: not read: {} in {}, the first being {}. Depths are 16-bit grey PNG, TIFF or "
            ".npy.",
            counted(count, "file"), depths.string(), first.filename().string()));
}

/// Checks that depths belong to photos; COLMAP may have left photos out, whose depths then have no
/// view.
void check_depths(const fs::path& depths, const fs::path& images, const Dataset& dataset) {
    std::set<fs::path> known;
    for (const View& view : dataset.views)
        for (const fs::path& stem : depth_stems(view.name)) known.insert(stem);
    for (const auto& entry : fs::recursive_directory_iterator(depths)) {
        const fs::path& file = entry.path();
        if (!entry.is_regular_file() || file.filename().string().starts_with('.')) continue;
        if (!is_depth_name(file)) continue;
        fs::path stem = fs::relative(file, depths).replace_extension();
        for (const std::string_view word : {"_depth", ".depth"})
            if (const std::string name = stem.generic_string();
                name.ends_with(word) && !known.contains(stem))
                stem = name.substr(0, name.size() - word.size());
        if (known.contains(stem) || !find_photo(images, stem.string()).empty()) continue;
        throw Error(
            file.string(), "belongs to no photo",
            fmt::format("Name it like its photo in {}, with .png, .tif or .npy, or remove it.",
                        images.string()));
    }
}

/// Turns a depth image as its photo is turned, passing its floats as RGBA pixels.
ImageF turned(ImageF depth, const View& view) {
    ImageU8 bytes(depth.width, depth.height, 4);
    std::memcpy(bytes.data.data(), depth.data.data(), bytes.data.size());
    const ImageU8 out = turn_with_photo(std::move(bytes), view, view.depth, "depths");
    ImageF result(out.width, out.height, 1);
    std::memcpy(result.data.data(), out.data.data(), out.data.size());
    return result;
}

/// Interpolates between the measured neighbours of a place in the file, px.
class Depths {
  public:
    explicit Depths(ImageF image) : image_(std::move(image)) {}
    const ImageF& image() const { return image_; }

    /// reach: half the size of the requesting pixel in px of the file, along each axis.
    float at(glm::dvec2 place, glm::dvec2 reach) const {
        const double x = std::clamp(place.x - 0.5, 0.0, image_.width - 1.0);
        const double y = std::clamp(place.y - 0.5, 0.0, image_.height - 1.0);
        const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
        const int x1 = std::min(x0 + 1, image_.width - 1), y1 = std::min(y0 + 1, image_.height - 1);
        const float corners[] = {image_.at(x0, y0, 0), image_.at(x1, y0, 0), image_.at(x0, y1, 0),
                                 image_.at(x1, y1, 0)};
        const auto [least, most] = std::minmax_element(std::begin(corners), std::end(corners));
        if (!(*least > 0) || *most > (1 + kOneSurface) * *least) return nearest(place, reach);
        const auto u = static_cast<float>(x - x0), v = static_cast<float>(y - y0);
        return (1 - v) * ((1 - u) * corners[0] + u * corners[1]) +
               v * ((1 - u) * corners[2] + u * corners[3]);
    }

  private:
    float nearest(glm::dvec2 place, glm::dvec2 reach) const {
        const glm::dvec2 low = place - reach, high = place + reach;
        float depth = 0;
        double least = 1e300;
        for (int y = std::max(0, static_cast<int>(low.y));
             y < std::min<double>(image_.height, std::ceil(high.y)); ++y)
            for (int x = std::max(0, static_cast<int>(low.x));
                 x < std::min<double>(image_.width, std::ceil(high.x)); ++x) {
                const double dx = x + 0.5 - place.x, dy = y + 0.5 - place.y;
                const double distance = dx * dx + dy * dy;
                if (!(image_.at(x, y, 0) > 0) || distance >= least) continue;
                least = distance;
                depth = image_.at(x, y, 0);
            }
        return depth;
    }

    ImageF image_;
};

/// Ratios of the depths of points that a view sees to the depths measured there.
std::vector<double> ratios_of(const Dataset& dataset, std::size_t v) {
    const View& view = dataset.views[v];
    const ImageF depth = load_depth(view);
    const PointCloud& points = dataset.points;
    std::vector<double> ratios;
    for (std::size_t p = 0; p < points.size(); ++p)
        for (std::size_t k = points.seen_begin[p]; k < points.seen_begin[p + 1]; ++k) {
            if (points.seen_by[k] != v) continue;
            const double* at = &points.position[3 * p];
            const Camera& c = view.camera;
            const glm::dvec3 q = c.rotation * glm::dvec3(at[0], at[1], at[2]) + c.translation;
            const double x = c.fx * q.x / q.z + c.cx, y = c.fy * q.y / q.z + c.cy;
            if (!(q.z > 0 && x >= 0 && y >= 0 && x < depth.width && y < depth.height)) continue;
            const float d = depth.at(static_cast<int>(x), static_cast<int>(y), 0);
            if (d > 0) ratios.push_back(q.z / d);
        }
    return ratios;
}

}  // namespace

void add_depths(const fs::path& folder, const fs::path& images, const DatasetOptions& options,
                Dataset& dataset) {
    const fs::path depths = depths_folder(folder);
    if (const fs::path scales = folder / "sparse/0/depth_params.json";
        !depths.empty() && fs::exists(scales)) {
        dataset.notes.push_back(
            fmt::format("{} is left out: {} says that its depths are inverse ones that a network "
                        "estimated, as 3DGS takes them, and darb reads measured depths.",
                        depths.string(), scales.string()));
        return;
    }
    std::size_t with = 0;
    if (depths.empty()) {
        with = find_depths_beside_photos(dataset);
        if (with > 0)
            dataset.notes.push_back(
                fmt::format("Depths were found beside the photos: {} of {} photos have none.",
                            dataset.views.size() - with, dataset.views.size()));
        else if (const std::string unused = unused_folders({folder}, {"depth"});
                 !unused.empty() && options.require_photos)
            dataset.notes.push_back(fmt::format(
                "Not used: {}. If these are measured depths, name their folder depths and the "
                "files as the photos, with .png, .tif or .npy.",
                unused));
        return;
    }
    for (View& view : dataset.views) {
        view.depth = find_depth(depths, view.name);
        with += view.depth.empty() ? 0 : 1;
    }
    if (options.require_photos) check_depths(depths, images, dataset);
    note_unread_depths(depths, dataset);
    if (with > 0 && with < dataset.views.size())
        dataset.notes.push_back(fmt::format("{}: {} of {} photos have none.", depths.string(),
                                            dataset.views.size() - with, dataset.views.size()));
}

ImageF load_depth(const View& view) {
    const Depths file(
        turned(read_depth(view.depth, view.depth_unit, view.depth_unit_of_integers), view));
    const Camera& camera = view.camera;
    const glm::dvec2 photo(view.lens.width, view.lens.height),
        size(file.image().width, file.image().height), own(camera.width, camera.height);
    const glm::dvec2 reach = glm::max(0.5 * size / own, glm::dvec2(0.5));
    const bool straightens = view.lens.distorted() && !camera.lens.active;
    const Lens lens(view.lens);
    ImageF depth(camera.width, camera.height, 1);
    for (int y = 0; y < camera.height; ++y)
        for (int x = 0; x < camera.width; ++x) {
            const glm::dvec2 pixel(x + 0.5, y + 0.5);
            glm::dvec2 place = pixel / own * photo;  // px in the photo
            if (straightens) {
                const glm::dvec2 ray((pixel.x - camera.cx) / camera.fx,
                                     (pixel.y - camera.cy) / camera.fy);
                if (!lens.valid(ray)) continue;
                place = lens.project(ray);
            }
            const bool inside =
                place.x >= 0 && place.y >= 0 && place.x <= photo.x && place.y <= photo.y;
            if (inside) depth.at(x, y, 0) = file.at(place / photo * size, reach);
        }
    return depth;
}

void find_depth_scale(Dataset& dataset) {
    std::vector<std::size_t> views;
    for (std::size_t v = 0; v < dataset.views.size(); ++v)
        if (!dataset.views[v].depth.empty()) views.push_back(v);
    if (dataset.options.depth_scale) {
        dataset.depth_scale = *dataset.options.depth_scale;
        if (!views.empty()) dataset.metres_per_unit = 1 / dataset.depth_scale;
    }
    if (views.empty() || dataset.options.depth_scale || dataset.points.seen_by.empty()) return;
    std::vector<double> ratios;
    const std::size_t count = std::min(views.size(), kViewsForScale);
    for (std::size_t i = 0; i < count; ++i) {
        const std::vector<double> own = ratios_of(dataset, views[i * views.size() / count]);
        ratios.insert(ratios.end(), own.begin(), own.end());
    }
    if (ratios.size() < kLeastPoints)
        throw Error(dataset.views[views[0]].depth.string(),
                    fmt::format("says with the others of only {} points how deep they are: the "
                                "scale of the scene cannot be found",
                                ratios.size()),
                    "Say how many world units a metre is with --depth-scale.");
    dataset.depth_scale = nearest_rank(ratios, 0.5);
    const double spread =
        (nearest_rank(ratios, 0.75) - nearest_rank(ratios, 0.25)) / dataset.depth_scale;
    if (spread <= kOfTheSameScene) dataset.metres_per_unit = 1 / dataset.depth_scale;
    dataset.notes.push_back(fmt::format(
        "{}A metre of the measured depths is {:.4g} world units, by {} points (the middle half of "
        "them within {:.1f} %); --depth-scale says otherwise{}.",
        spread > kOfTheSameScene ? "Warning: the depths do not fit the points. " : "",
        dataset.depth_scale, ratios.size(), 100 * spread,
        spread > kOfTheSameScene ? ", as --depth-scale 1 where the cameras are in metres" : ""));
}

}  // namespace darb
