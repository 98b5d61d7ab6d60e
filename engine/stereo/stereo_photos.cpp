#include "engine/stereo/stereo_photos.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/core/quantile.h"
#include "engine/data/region.h"
#include "engine/data/resample.h"

namespace darb {

namespace {

constexpr size_t kFewPoints = 10;                // too few for a range of depths
constexpr size_t kLookedAt = 400;                // points of a view
constexpr double kNearer = 0.7, kFarther = 1.6;  // than the points
constexpr double kStray = 0.02;         // share of the points at each end that may be wrong
constexpr double kNearestShare = 0.05;  // of the way to the middle of the region
constexpr double kGoodAngle = 12, kBelow = 6, kAbove = 12;  // degrees
constexpr double kLeastShare = 0.05;                        // of what a photo shows, for a source
constexpr std::uint8_t kOpaque = 128;

ImageF grey_of(const ImageU8& rgba) {
    ImageF grey(rgba.width, rgba.height, 1);
    for (size_t i = 0; i < grey.data.size(); ++i) {
        const std::uint8_t* c = &rgba.data[4 * i];
        grey.data[i] =
            c[3] < kOpaque ? -1.0f : (0.299f * c[0] + 0.587f * c[1] + 0.114f * c[2]) / 255.0f;
    }
    return grey;
}

StereoPhoto small_photo(const View& view, const ImageU8& rgba, int longest_side) {
    StereoPhoto photo;
    const double scale = std::min(1.0, double(longest_side) / std::max(rgba.width, rgba.height));
    const int width = std::max(1, static_cast<int>(std::lround(rgba.width * scale))),
              height = std::max(1, static_cast<int>(std::lround(rgba.height * scale)));
    photo.camera = view.camera;
    const double x = double(width) / rgba.width, y = double(height) / rgba.height;
    photo.camera.width = width;
    photo.camera.height = height;
    photo.camera.fx *= x;
    photo.camera.cx *= x;
    photo.camera.fy *= y;
    photo.camera.cy *= y;
    photo.rgba = box_downscale(rgba, width, height);
    photo.grey = grey_of(photo.rgba);
    return photo;
}

glm::dvec3 to_camera(const Camera& camera, const glm::dvec3& point) {
    return camera.rotation * point + camera.translation;
}

bool is_seen(const Camera& camera, const glm::dvec3& point) {
    const glm::dvec3 p = to_camera(camera, point);
    if (!(p.z > 0)) return false;
    const double x = camera.fx * p.x / p.z + camera.cx, y = camera.fy * p.y / p.z + camera.cy;
    return x >= 0 && y >= 0 && x < camera.width && y < camera.height;
}

using Points = std::vector<glm::dvec3>;

// By view: the points that the source says it saw, or else those in its frame.
std::vector<Points> points_of_views(const Dataset& dataset) {
    const PointCloud& cloud = dataset.points;
    std::vector<Points> seen(dataset.views.size());
    for (size_t p = 0; p < cloud.size(); ++p) {
        const double* at = &cloud.position[3 * p];
        const glm::dvec3 point(at[0], at[1], at[2]);
        if (!cloud.seen_begin.empty()) {
            for (size_t k = cloud.seen_begin[p]; k < cloud.seen_begin[p + 1]; ++k)
                seen[cloud.seen_by[k]].push_back(point);
        } else {
            for (size_t v = 0; v < seen.size(); ++v)
                if (is_seen(dataset.views[v].camera, point)) seen[v].push_back(point);
        }
    }
    return seen;
}

void set_range_of_points(const Points& points, StereoPhoto& photo) {
    std::vector<double> depth;
    for (const glm::dvec3& p : points) {
        const double z = to_camera(photo.camera, p).z;
        if (z > 0) depth.push_back(z);
    }
    if (depth.size() < kFewPoints) return;
    std::sort(depth.begin(), depth.end());
    photo.near = kNearer * quantile(depth, kStray);
    photo.far = kFarther * quantile(depth, 1 - kStray);
}

void set_range_of_region(const Region& region, StereoPhoto& photo) {
    const double middle = to_camera(photo.camera, region.centre).z;
    const double half = glm::length(region.half);
    if (!(middle + half > 0)) return;
    photo.far = middle + half;
    photo.near = std::max(middle - half, kNearestShare * photo.far);
}

// Places in the frame at depths of the range, where there are no points to say what a photo shows.
Points places_in_frame(const StereoPhoto& photo) {
    constexpr int kSteps = 6, kDepths = 3;
    Points places;
    const Camera& c = photo.camera;
    for (int j = 0; j < kSteps; ++j)
        for (int i = 0; i < kSteps; ++i)
            for (int d = 0; d < kDepths; ++d) {
                const double share = (d + 0.5) / kDepths;
                const double z = 1 / (share / photo.near + (1 - share) / photo.far);
                const double x = (i + 0.5) / kSteps * c.width, y = (j + 0.5) / kSteps * c.height;
                const glm::dvec3 p(z * (x - c.cx) / c.fx, z * (y - c.cy) / c.fy, z);
                places.push_back(glm::transpose(c.rotation) * (p - c.translation));
            }
    return places;
}

double worth(const Camera& reference, const Camera& source, const Points& points) {
    const glm::dvec3 a = reference.centre(), b = source.centre();
    double sum = 0;
    const size_t step = points.size() / kLookedAt + 1;
    for (size_t p = 0; p < points.size(); p += step) {
        if (!is_seen(source, points[p])) continue;
        const double cosine =
            glm::dot(glm::normalize(points[p] - a), glm::normalize(points[p] - b));
        const double angle = glm::degrees(std::acos(std::clamp(cosine, -1.0, 1.0)));
        const double apart = (angle - kGoodAngle) / (angle < kGoodAngle ? kBelow : kAbove);
        sum += std::exp(-0.5 * apart * apart);
    }
    return sum * static_cast<double>(step) /
           static_cast<double>(std::max<size_t>(points.size(), 1));
}

void choose_sources(std::vector<StereoPhoto>& photos, const std::vector<Points>& shown,
                    std::uint32_t most) {
    for (size_t r = 0; r < photos.size(); ++r) {
        std::vector<std::pair<double, std::uint32_t>> worths;
        for (size_t s = 0; s < photos.size(); ++s) {
            if (s == r) continue;
            const double w = worth(photos[r].camera, photos[s].camera, shown[r]);
            if (w > kLeastShare) worths.emplace_back(-w, static_cast<std::uint32_t>(s));
        }
        std::sort(worths.begin(), worths.end());
        for (size_t k = 0; k < std::min<size_t>(most, worths.size()); ++k)
            photos[r].sources.push_back(worths[k].second);
    }
}

}  // namespace

std::vector<StereoPhoto> stereo_photos(const Dataset& dataset, const std::vector<ImageU8>& photos,
                                       const StereoOptions& options) {
    std::vector<StereoPhoto> chosen;
    std::vector<Points> shown;
    const Region region = region_in_view(dataset);
    std::vector<Points> seen = points_of_views(dataset);
    for (size_t v = 0; v < dataset.views.size(); ++v) {
        const View& view = dataset.views[v];
        if (view.is_test || view.camera.lens.active) continue;
        StereoPhoto photo = small_photo(view, photos[v], options.longest_side);
        photo.view = v;
        set_range_of_points(seen[v], photo);
        const bool has_points = photo.far > 0;
        if (!has_points) set_range_of_region(region, photo);
        if (!(photo.far > photo.near)) continue;
        shown.push_back(has_points ? std::move(seen[v]) : places_in_frame(photo));
        chosen.push_back(std::move(photo));
    }
    choose_sources(chosen, shown, std::min<std::uint32_t>(options.sources, 8));
    return chosen;
}

}  // namespace darb
