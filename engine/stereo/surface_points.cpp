#include "engine/stereo/surface_points.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/core/on_threads.h"

namespace darb {

namespace {

struct Match {
    std::uint32_t photo;
    int x, y;             // the pixel
    glm::dvec3 position;  // world, of its own depth
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

    // Pixels of other photos whose depth agrees with that of this one.
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
    std::vector<std::vector<std::uint32_t>> beside_;  // sources, and those that it is one of

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

// Which pixels of a photo lie within the spacing of a point.
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
