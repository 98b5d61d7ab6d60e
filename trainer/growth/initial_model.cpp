// SPDX-License-Identifier: MIT
#include "trainer/growth/initial_model.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <glm/glm.hpp>
#include <numeric>
#include <set>

#include "engine/core/files.h"
#include "engine/core/rng.h"
#include "engine/data/dataset.h"
#include "engine/data/image_io.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_model.h"
#include "trainer/options/schedule.h"

namespace darb {

namespace {

// float32 resolves 1/4,000,000 of a scene's width there: an update late in a run is 1/600,000 of
// it.
constexpr double kFarOff = 4;

// For splats on surfaces (docs/experiments/dense_start.md): the standard deviation along the
// surface as a share of the distance to the next point, and that across it as a share of that along
// it.
constexpr double kSurfaceWidth = 0.6, kSurfaceThickness = 0.3, kSurfaceOpacity = 0.5;

// The points to start from; empty where the start is random.
const PointCloud& given_points(const Dataset& dataset, const TrainOptions& options) {
    static const PointCloud kNone;
    if (options.start == StartPoints::random) return kNone;
    const bool takes_start = options.start != StartPoints::points && dataset.start.size() > 0;
    return takes_start ? dataset.start : dataset.points;
}

}  // namespace

bool starts_random(const Dataset& dataset, const TrainOptions& options) {
    return given_points(dataset, options).size() == 0;
}

std::uint64_t start_points(const Dataset& dataset, const TrainOptions& options) {
    const std::size_t given = given_points(dataset, options).size();
    if (given > 0) return given;
    std::uint64_t pixels = 0;
    for (const View& v : dataset.views)
        if (!v.is_test) pixels += std::uint64_t(v.camera.width) * v.camera.height;
    return options.random_points ? *options.random_points
                                 : std::clamp<std::uint64_t>(pixels / 32, 1'000, 100'000);
}

namespace {

PointCloud random_points(const Dataset& dataset, const TrainOptions& options) {
    const std::uint64_t wanted = start_points(dataset, options);
    const WatchedBox region = region_in_view(dataset);
    Pcg32 random(options.seed, 1);
    PointCloud cloud;
    for (std::uint64_t i = 0; i < wanted; ++i)
        for (int a = 0; a < 3; ++a) {
            cloud.position.push_back(region.centre[a] + region.half[a] * random.uniform(-1.0, 1.0));
            cloud.colour.push_back(static_cast<std::uint8_t>(random.below(256)));
        }
    return cloud;
}

// A drawn part of the cloud: a file's order follows its making, from one end of a scene to the
// other.
PointCloud drawn_from(const PointCloud& cloud, std::uint32_t count, std::uint64_t seed) {
    std::vector<std::uint32_t> order(cloud.size());
    std::iota(order.begin(), order.end(), 0U);
    Pcg32 random(seed, 2);
    PointCloud part;
    for (std::uint32_t i = 0; i < count; ++i) {
        std::swap(order[i], order[i + random.below(static_cast<std::uint32_t>(order.size()) - i)]);
        for (int a = 0; a < 3; ++a) {
            part.position.push_back(cloud.position[3 * order[i] + a]);
            part.colour.push_back(cloud.colour[3 * order[i] + a]);
            if (!cloud.normal.empty()) part.normal.push_back(cloud.normal[3 * order[i] + a]);
        }
        // Fewer points cover the same surface.
        if (!cloud.spacing.empty())
            part.spacing.push_back(
                cloud.spacing[order[i]] *
                std::sqrt(static_cast<float>(cloud.size()) / static_cast<float>(count)));
    }
    return part;
}

// A splat of the surface: flat along the normal, as wide as the points are apart.
void lay_flat(const PointCloud& points, size_t i, double length_scale, SplatModel& model) {
    const glm::dvec3 n(points.normal[3 * i], points.normal[3 * i + 1], points.normal[3 * i + 2]);
    const double width = std::log(kSurfaceWidth * points.spacing[i] * length_scale);
    const double scale[3] = {width, width, width + std::log(kSurfaceThickness)};
    // The shortest turn from z to the normal, which may point either way.
    const glm::dvec3 up = n.z < 0 ? -n : n;
    const double norm = std::sqrt(2 * (1 + up.z));
    const double rotation[4] = {1 + up.z, -up.y, up.x, 0};
    for (int a = 0; a < 3; ++a) model.log_scale[3 * i + a] = static_cast<float>(scale[a]);
    for (int a = 0; a < 4; ++a) model.rotation[4 * i + a] = static_cast<float>(rotation[a] / norm);
    model.opacity_logit[i] = static_cast<float>(std::log(kSurfaceOpacity / (1 - kSurfaceOpacity)));
}

}  // namespace

std::uint32_t initial_count(const Dataset& dataset, const TrainOptions& options) {
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(
        start_points(dataset, options), options.max_splats.value_or(kAnyNumberOfSplats)));
}

SplatModel initial_model(const Dataset& dataset, const Schedule& schedule) {
    const TrainOptions& options = schedule.options;
    PointCloud drawn;
    const bool random = starts_random(dataset, options);
    if (random) drawn = random_points(dataset, options);
    const PointCloud& given = random ? drawn : given_points(dataset, options);
    const std::uint32_t most = options.max_splats.value_or(kAnyNumberOfSplats);
    const bool too_many = given.size() > most;
    if (too_many) drawn = drawn_from(given, most, options.seed);
    const PointCloud& points = random || too_many ? drawn : given;
    const std::vector<double> distance2 = neighbour_distance2(points.position);
    SplatModel model;
    model.sh_degree = options.sh_degree;
    model.kernel = options.kernel;
    model.footprint = options.footprint;
    model.origin = choose_origin(points.position, kFarOff);
    model.resize(points.size());
    set_kernel(model, options.kernel);
    // A hair above: the default is what is pruned, too, and a point that no frame has shown stays.
    const double opacity = std::min(1.001 * schedule.initial_opacity, 0.999);
    const auto logit = static_cast<float>(std::log(opacity / (1 - opacity)));
    const double initial_scale = schedule.initial_scale * schedule.length_scale;
    for (size_t i = 0; i < model.size(); ++i) {
        model.rotation[4 * i] = 1.0f;
        model.opacity_logit[i] = logit;
        for (int a = 0; a < 3; ++a) {
            const size_t at = 3 * i + a;
            model.position[at] = static_cast<float>(points.position[at] - model.origin[a]);
            model.log_scale[at] =
                static_cast<float>(0.5 * std::log(distance2[i]) + std::log(initial_scale));
            model.sh_dc[at] = static_cast<float>((points.colour[at] / 255.0 - 0.5) / SH_C0);
        }
        if (!points.spacing.empty() && points.spacing[i] > 0)
            lay_flat(points, i, schedule.length_scale, model);
    }
    return model;
}

namespace {

// Yellow to blue by way of green: a few of viridis' colours.
constexpr std::array<glm::vec3, 5> kDepthColours = {
    glm::vec3(253, 231, 37), {94, 201, 98}, {33, 145, 140}, {59, 82, 139}, {68, 1, 84}};

glm::vec3 depth_colour(double share) {
    const double place = std::clamp(share, 0.0, 1.0) * (kDepthColours.size() - 1);
    const auto below = std::min(static_cast<std::size_t>(place), kDepthColours.size() - 2);
    return glm::mix(kDepthColours[below], kDepthColours[below + 1],
                    static_cast<float>(place - static_cast<double>(below)));
}

// Whether a photo has a depth that agrees near this point: it is on a surface that is there.
bool is_covered(const DenseStart& start, const glm::dvec3& point) {
    constexpr double kApart = 0.05;
    for (std::size_t r = 0; r < start.photos.size(); ++r) {
        const Camera& c = start.photos[r].camera;
        const glm::dvec3 p = c.rotation * point + c.translation;
        if (!(p.z > 0)) continue;
        const double x = c.fx * p.x / p.z + c.cx, y = c.fy * p.y / p.z + c.cy;
        if (!(x >= 0 && y >= 0 && x < c.width && y < c.height)) continue;
        const int column = static_cast<int>(x), row = static_cast<int>(y);
        if (start.consistent[r].at(column, row, 0) == 0) continue;
        if (std::abs(start.maps[r].at(column, row, 0) * p.z - 1) < kApart) return true;
    }
    return false;
}

void add_points_beside(const PointCloud& points, DenseStart& start) {
    for (std::size_t p = 0; p < points.size(); ++p) {
        const double* at = &points.position[3 * p];
        if (is_covered(start, {at[0], at[1], at[2]})) continue;
        for (int a = 0; a < 3; ++a) {
            start.cloud.position.push_back(at[a]);
            start.cloud.colour.push_back(points.colour[3 * p + a]);
            start.cloud.normal.push_back(0);
        }
        start.cloud.spacing.push_back(0);
    }
}

template <class T>
void put(std::string& to, T value) {
    char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    to.append(bytes, sizeof(T));
}

std::string points_ply(const PointCloud& cloud) {
    std::string file = fmt::format(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty "
        "double y\nproperty double z\nproperty float nx\nproperty float ny\nproperty float nz\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
        cloud.size());
    for (std::size_t p = 0; p < cloud.size(); ++p) {
        for (int a = 0; a < 3; ++a) put(file, cloud.position[3 * p + a]);
        for (int a = 0; a < 3; ++a) put(file, cloud.normal[3 * p + a]);
        for (int a = 0; a < 3; ++a) put(file, cloud.colour[3 * p + a]);
    }
    return file;
}

ImageU8 picture_of(const DenseStart& start, std::size_t photo) {
    const StereoPhoto& from = start.photos[photo];
    const PlaneMap& map = start.maps[photo];
    ImageU8 picture(3 * map.width, map.height, 3);
    for (int y = 0; y < map.height; ++y)
        for (int x = 0; x < map.width; ++x) {
            const bool found = map.at(x, y, 3) < STEREO_NO_COST;
            const double share = (1 / from.near - map.at(x, y, 0)) / (1 / from.near - 1 / from.far);
            const glm::vec3 depth = found ? depth_colour(share) : glm::vec3(0);
            for (int c = 0; c < 3; ++c) {
                picture.at(x, y, c) = from.rgba.at(x, y, c);
                picture.at(map.width + x, y, c) = static_cast<std::uint8_t>(depth[c]);
                if (start.consistent[photo].at(x, y, 0) != 0)
                    picture.at(2 * map.width + x, y, c) = static_cast<std::uint8_t>(depth[c]);
            }
        }
    return picture;
}

}  // namespace

bool lacks_points(const Dataset& dataset, const TrainOptions& options) {
    return options.start == StartPoints::automatic && dataset.points.size() == 0 &&
           !options.random_points;
}

DenseStart dense_start(Device& device, const Dataset& dataset, const std::vector<ImageU8>& photos,
                       std::uint64_t seed) {
    const auto begin = std::chrono::steady_clock::now();
    DenseStart start;
    start.photos = stereo_photos(dataset, photos, {});
    for (const StereoPhoto& photo : start.photos)
        start.names.push_back(dataset.views[photo.view].name);
    start.maps = plane_maps(device, start.photos, seed);
    SurfacePoints found = surface_points(start.photos, start.maps, {});
    start.consistent = std::move(found.consistent);
    start.cloud = std::move(found.points);
    start.on_surfaces = start.cloud.size();
    start.agreeing = static_cast<double>(found.agreeing) /
                     static_cast<double>(std::max<std::size_t>(found.looked_at, 1));
    add_points_beside(dataset.points, start);
    start.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return start;
}

void find_lacking_points(Device& device, const std::vector<ImageU8>& photos,
                         const TrainOptions& options, Dataset& dataset) {
    if (!lacks_points(dataset, options)) return;
    DenseStart start = dense_start(device, dataset, photos, options.seed);
    if (start.on_surfaces >= kLeastOnSurfaces) dataset.start = std::move(start.cloud);
}

void write_dense_start(const DenseStart& start, const std::filesystem::path& folder) {
    write_file_atomic(folder / "points.ply", points_ply(start.cloud));
    std::set<std::string> used;
    for (std::size_t p = 0; p < start.photos.size(); ++p)
        write_png(folder / picture_name(start.names[p], used), picture_of(start, p));
}

}  // namespace darb
