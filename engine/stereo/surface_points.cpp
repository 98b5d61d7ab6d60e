// SPDX-License-Identifier: MIT
#include "engine/stereo/surface_points.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "engine/core/on_threads.h"
#include "engine/core/quantile.h"
#include "engine/data/dataset.h"
#include "engine/data/image_io.h"
#include "engine/gpu/commands.h"
#include "engine/primitives/groups.h"

namespace darb {

namespace {

constexpr size_t kFewPoints = 10;                // too few for a range of depths
constexpr size_t kLookedAt = 400;                // points per view
constexpr double kNearer = 0.7, kFarther = 1.6;  // than the points
constexpr double kStray = 0.02;         // share of the points at each end that may be wrong
constexpr double kNearestShare = 0.05;  // share of the distance to the middle of the region
constexpr double kGoodAngle = 12, kBelow = 6, kAbove = 12;  // degrees
constexpr double kLeastShare = 0.05;                        // a source shows at least this share of
                                                            // what the photo shows
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

// For each view, the points that the source says it saw, or else those in its frame.
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

void set_range_of_region(const WatchedBox& region, StereoPhoto& photo) {
    const double middle = to_camera(photo.camera, region.centre).z;
    const double half = glm::length(region.half);
    if (!(middle + half > 0)) return;
    photo.far = middle + half;
    photo.near = std::max(middle - half, kNearestShare * photo.far);
}

// Places in the frame at depths within the range, for when no points tell what a photo shows.
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
    const WatchedBox region = region_in_view(dataset);
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

namespace {

constexpr int kStarts = 12, kSweeps = 4;
constexpr float kFirstReach = 0.04f;  // size of the random changes; halved in each further sweep
constexpr double kSteepest = 4;       // tangent of the angle between surface and picture, at most

glm::dmat3 intrinsics(const Camera& c) {
    return {c.fx, 0, 0, 0, c.fy, 0, c.cx, c.cy, 1};
}

// One word per pixel: its grey and those to its right, below, and both, 1 to 255; 0: no photo.
void add_greys(const ImageF& grey, std::vector<std::uint32_t>& words) {
    const auto byte = [&](int x, int y) -> std::uint32_t {
        if (x >= grey.width || y >= grey.height) return 0;
        const float g = grey.at(x, y, 0);
        return g < 0 ? 0 : static_cast<std::uint32_t>(std::clamp(std::lround(255 * g), 1L, 255L));
    };
    for (int y = 0; y < grey.height; ++y)
        for (int x = 0; x < grey.width; ++x)
            words.push_back(byte(x, y) | byte(x + 1, y) << 8 | byte(x, y + 1) << 16 |
                            byte(x + 1, y + 1) << 24);
}

// The greys of the photo and of its sources, one after the other.
std::vector<std::uint32_t> greys_of(const std::vector<StereoPhoto>& photos, std::size_t reference) {
    std::vector<std::uint32_t> words;
    add_greys(photos[reference].grey, words);
    for (const std::uint32_t s : photos[reference].sources) add_greys(photos[s].grey, words);
    return words;
}

gpu::StereoArgs args_of(const StereoPhoto& photo, std::uint32_t seed) {
    const Camera& c = photo.camera;
    gpu::StereoArgs args{};
    args.width = static_cast<std::uint32_t>(c.width);
    args.height = static_cast<std::uint32_t>(c.height);
    args.sources = static_cast<std::uint32_t>(photo.sources.size());
    args.seed = seed;
    args.farthest = static_cast<float>(1 / photo.far);
    args.nearest = static_cast<float>(1 / photo.near);
    args.steepest = static_cast<float>(kSteepest / std::max(c.fx, c.fy));
    return args;
}

class PatchMatch {
  public:
    explicit PatchMatch(Device& device)
        : device_(&device),
          start_(device, "stereo_start", {{"THREADS", SPLAT_GROUP}, {"STARTS", kStarts}}),
          sweep_(device, "stereo_sweep", {{"THREADS", SPLAT_GROUP}}),
          commands_(device) {}

    PlaneMap run(const std::vector<StereoPhoto>& photos, std::size_t reference,
                 std::uint32_t seed) {
        const StereoPhoto& photo = photos[reference];
        PlaneMap planes(photo.grey.width, photo.grey.height, 4);
        if (photo.sources.empty()) {
            for (std::size_t i = 3; i < planes.data.size(); i += 4) planes.data[i] = STEREO_NO_COST;
            return planes;
        }
        upload(greys_, "stereo greys", greys_of(photos, reference));
        upload(sources_, "stereo sources", stereo_sources(photos, reference));
        const std::uint64_t bytes = planes.data.size() * sizeof(float);
        if (planes_.bytes() != bytes) {
            planes_ = Buffer();
            planes_ = Buffer(*device_, "stereo planes", bytes, Memory::device, "stereo");
        }
        record(args_of(photo, seed));
        commands_.submit_and_wait();
        planes.data = planes_.download<float>(planes.data.size());
        return planes;
    }

  private:
    Device* device_;
    Pipeline start_, sweep_;
    Commands commands_;
    Buffer greys_, sources_, planes_;

    template <class T>
    void upload(Buffer& buffer, const char* name, const std::vector<T>& values) {
        const std::uint64_t bytes = values.size() * sizeof(T);
        if (buffer.bytes() < bytes) {
            buffer = Buffer();
            buffer = Buffer(*device_, name, bytes, Memory::device, "stereo");
        }
        buffer.upload(values);
    }

    void record(gpu::StereoArgs args) {
        const std::uint64_t half = std::uint64_t{(args.width + 1) / 2} * args.height;
        const Groups all = groups_for(std::uint64_t{args.width} * args.height),
                     each = groups_for(half);
        commands_.begin();
        commands_.pass("stereo start");
        commands_.dispatch(start_, args, {greys_, sources_, planes_}, all.x, all.y);
        commands_.pass("stereo sweeps");
        args.reach = kFirstReach;
        for (int sweep = 0; sweep < kSweeps; ++sweep) {
            for (args.colour = 0; args.colour < 2; ++args.colour) {
                ++args.seed;
                commands_.dispatch(sweep_, args, {greys_, sources_, planes_}, each.x, each.y);
            }
            args.reach /= 2;
        }
    }
};

}  // namespace

std::vector<gpu::StereoSource> stereo_sources(const std::vector<StereoPhoto>& photos,
                                              std::size_t reference) {
    const Camera& from = photos[reference].camera;
    const glm::dmat3 ray = glm::inverse(intrinsics(from));
    std::vector<gpu::StereoSource> sources;
    std::size_t first = photos[reference].grey.data.size();
    for (const std::uint32_t s : photos[reference].sources) {
        const Camera& to = photos[s].camera;
        const glm::dmat3 turn = to.rotation * glm::transpose(from.rotation);
        gpu::StereoSource source{};
        source.toward = glm::mat3(intrinsics(to) * turn * ray);
        source.shift = glm::vec3(intrinsics(to) * (to.translation - turn * from.translation));
        source.width = static_cast<std::uint32_t>(to.width);
        source.height = static_cast<std::uint32_t>(to.height);
        source.first = static_cast<std::uint32_t>(first);
        first += photos[s].grey.data.size();
        sources.push_back(source);
    }
    return sources;
}

std::vector<PlaneMap> plane_maps(Device& device, const std::vector<StereoPhoto>& photos,
                                 std::uint64_t seed) {
    PatchMatch match(device);
    std::vector<PlaneMap> maps;
    for (std::size_t r = 0; r < photos.size(); ++r)
        maps.push_back(match.run(photos, r, static_cast<std::uint32_t>(seed * 1009 + 64 * r)));
    return maps;
}

namespace {

struct Match {
    std::uint32_t photo;
    int x, y;             // the pixel
    glm::dvec3 position;  // world, at the pixel's own depth
    glm::dvec3 normal;    // world, towards its camera
};

struct Plane {
    double v, by_x, by_y, cost;
};

class Fusion {
  public:
    Fusion(const std::vector<StereoPhoto>& photos, const std::vector<PlaneMap>& maps,
           const FusionOptions& options)
        : photos_(photos), maps_(maps), options_(options) {
        for (size_t r = 0; r < photos.size(); ++r) beside_.push_back(photos[r].sources);
        for (size_t r = 0; r < photos.size(); ++r)
            for (const std::uint32_t s : photos[r].sources)
                if (std::find(beside_[s].begin(), beside_[s].end(), r) == beside_[s].end())
                    beside_[s].push_back(static_cast<std::uint32_t>(r));
    }

    // Finds pixels of other photos whose depth agrees with that of this one.
    std::vector<Match> matches(std::uint32_t r, int x, int y) const {
        std::vector<Match> found;
        const Plane plane = at(r, x, y);
        if (!(plane.cost <= options_.most_cost)) return found;
        const glm::dvec3 point = world(r, x + 0.5, y + 0.5, plane.v);
        for (const std::uint32_t s : beside_[r])
            if (const auto match = match_in(r, x, y, point, s)) found.push_back(*match);
        return found;
    }

    bool agree(std::uint32_t r, const std::vector<Match>& found) const {
        const size_t wanted = std::min<size_t>(size_t(options_.least_agreeing), beside_[r].size());
        return wanted > 0 && found.size() >= wanted;
    }

    Match own(std::uint32_t r, int x, int y) const {
        return {r, x, y, world(r, x + 0.5, y + 0.5, at(r, x, y).v), normal(r, x, y)};
    }

    double depth(std::uint32_t photo, const glm::dvec3& point) const {
        const Camera& c = photos_[photo].camera;
        return (c.rotation * point + c.translation).z;
    }

  private:
    const std::vector<StereoPhoto>& photos_;
    const std::vector<PlaneMap>& maps_;
    const FusionOptions& options_;
    std::vector<std::vector<std::uint32_t>> beside_;  // its sources, and photos of which it is a
                                                      // source

    Plane at(std::uint32_t photo, int x, int y) const {
        const float* p = &maps_[photo].data[maps_[photo].index(x, y, 0)];
        return {p[0], p[1], p[2], p[3]};
    }

    glm::dvec3 world(std::uint32_t photo, double x, double y, double v) const {
        const Camera& c = photos_[photo].camera;
        const glm::dvec3 p((x - c.cx) / c.fx, (y - c.cy) / c.fy, 1);
        return glm::transpose(c.rotation) * (p / v - c.translation);
    }

    // The plane's v is m . (x, y, 1): its normal is K^T m.
    glm::dvec3 normal(std::uint32_t photo, int x, int y) const {
        const Camera& c = photos_[photo].camera;
        const Plane p = at(photo, x, y);
        const double rest = p.v - p.by_x * (x + 0.5) - p.by_y * (y + 0.5);
        const glm::dvec3 n(c.fx * p.by_x, c.fy * p.by_y, c.cx * p.by_x + c.cy * p.by_y + rest);
        return -glm::normalize(glm::transpose(c.rotation) * n);
    }

    std::optional<glm::dvec2> pixel(std::uint32_t photo, const glm::dvec3& point) const {
        const Camera& c = photos_[photo].camera;
        const glm::dvec3 p = c.rotation * point + c.translation;
        if (!(p.z > 0)) return std::nullopt;
        const glm::dvec2 at(c.fx * p.x / p.z + c.cx, c.fy * p.y / p.z + c.cy);
        if (!(at.x >= 0 && at.y >= 0 && at.x < c.width && at.y < c.height)) return std::nullopt;
        return at;
    }

    std::optional<Match> match_in(std::uint32_t r, int x, int y, const glm::dvec3& point,
                                  std::uint32_t s) const {
        const auto there = pixel(s, point);
        if (!there) return std::nullopt;
        const int sx = static_cast<int>(there->x), sy = static_cast<int>(there->y);
        const Plane plane = at(s, sx, sy);
        if (!(plane.cost <= options_.most_cost)) return std::nullopt;
        const double v =
            plane.v + plane.by_x * (there->x - sx - 0.5) + plane.by_y * (there->y - sy - 0.5);
        if (!(std::abs(v * depth(s, point) - 1) <= options_.most_apart)) return std::nullopt;
        const glm::dvec3 other = world(s, there->x, there->y, v);
        const auto back = pixel(r, other);
        if (!back || glm::distance(*back, glm::dvec2(x + 0.5, y + 0.5)) > options_.most_apart_px)
            return std::nullopt;
        return Match{s, sx, sy, other, normal(s, sx, sy)};
    }
};

// Marks the pixels of a photo that lie within the spacing of a point.
class Taken {
  public:
    explicit Taken(const std::vector<StereoPhoto>& photos) {
        for (const StereoPhoto& p : photos) marks_.emplace_back(p.grey.width, p.grey.height, 1);
    }
    bool at(std::uint32_t photo, int x, int y) const { return marks_[photo].at(x, y, 0) != 0; }
    void mark(std::uint32_t photo, int x, int y, double radius) {
        ImageU8& image = marks_[photo];
        const int r = static_cast<int>(radius);
        for (int j = std::max(0, y - r); j <= std::min(image.height - 1, y + r); ++j)
            for (int i = std::max(0, x - r); i <= std::min(image.width - 1, x + r); ++i)
                if ((i - x) * (i - x) + (j - y) * (j - y) < radius * radius) image.at(i, j, 0) = 1;
    }

  private:
    std::vector<ImageU8> marks_;
};

void add_point(const std::vector<StereoPhoto>& photos, const std::vector<Match>& matches,
               double spacing, PointCloud& cloud) {
    glm::dvec3 position(0), normal(0), colour(0);
    for (const Match& m : matches) {
        position += m.position;
        normal += m.normal;
        const std::uint8_t* c = &photos[m.photo].rgba.data[photos[m.photo].rgba.index(m.x, m.y, 0)];
        colour += glm::dvec3(c[0], c[1], c[2]);
    }
    const double count = static_cast<double>(matches.size());
    normal = glm::dot(normal, normal) > 1e-12 ? glm::normalize(normal) : matches.front().normal;
    for (int a = 0; a < 3; ++a) {
        cloud.position.push_back(position[a] / count);
        cloud.normal.push_back(static_cast<float>(normal[a]));
        cloud.colour.push_back(static_cast<std::uint8_t>(std::lround(colour[a] / count)));
    }
    cloud.spacing.push_back(static_cast<float>(spacing));
}

}  // namespace

SurfacePoints surface_points(const std::vector<StereoPhoto>& photos,
                             const std::vector<PlaneMap>& maps, const FusionOptions& options) {
    const Fusion fusion(photos, maps, options);
    SurfacePoints result;
    for (const StereoPhoto& p : photos)
        result.consistent.emplace_back(p.grey.width, p.grey.height, 1);
    in_pieces(photos.size(), 1, [&](size_t first, size_t) {
        const auto r = static_cast<std::uint32_t>(first);
        ImageU8& image = result.consistent[r];
        for (int y = 0; y < image.height; ++y)
            for (int x = 0; x < image.width; ++x)
                if (fusion.agree(r, fusion.matches(r, x, y))) image.at(x, y, 0) = 255;
    });
    Taken taken(photos);
    for (std::uint32_t r = 0; r < photos.size(); ++r) {
        const Camera& camera = photos[r].camera;
        for (int y = 0; y < camera.height; ++y)
            for (int x = 0; x < camera.width; ++x) {
                ++result.looked_at;
                if (result.consistent[r].at(x, y, 0) == 0) continue;
                ++result.agreeing;
                if (taken.at(r, x, y)) continue;
                std::vector<Match> matches = fusion.matches(r, x, y);
                matches.insert(matches.begin(), fusion.own(r, x, y));
                const double spacing =
                    options.spacing_px * fusion.depth(r, matches.front().position) / camera.fx;
                for (const Match& m : matches)
                    taken.mark(
                        m.photo, m.x, m.y,
                        spacing * photos[m.photo].camera.fx / fusion.depth(m.photo, m.position));
                add_point(photos, matches, spacing, result.points);
            }
    }
    return result;
}

}  // namespace darb
