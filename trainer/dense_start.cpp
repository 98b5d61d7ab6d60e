#include "trainer/dense_start.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <set>

#include "engine/core/files.h"
#include "engine/data/image_io.h"

namespace darb {

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
