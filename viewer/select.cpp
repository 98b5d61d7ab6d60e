#include "viewer/select.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <unordered_map>

#include "engine/core/check.h"
#include "engine/scene/edit_splats.h"

namespace darb {

namespace {

constexpr double kColourOfDc = 0.28209479177387814;  // the harmonic of degree 0

SplatMask mask_of(const SplatModel& model, const std::function<bool(std::size_t)>& has) {
    SplatMask mask(model.size());
    for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = has(i) ? 1 : 0;
    return mask;
}

// px; nothing behind the camera.
std::optional<glm::dvec2> projected(const Camera& c, const glm::dvec3& world) {
    const glm::dvec3 p = c.rotation * world + c.translation;
    if (!(p.z > 0)) return {};
    return glm::dvec2(c.fx * p.x / p.z + c.cx, c.fy * p.y / p.z + c.cy);
}

SplatMask on_screen(const SplatModel& model, const Camera& camera,
                    const std::function<bool(const glm::dvec2&)>& has) {
    return mask_of(model, [&](std::size_t i) {
        const std::optional<glm::dvec2> at = projected(camera, position_of(model, i));
        return at && has(*at);
    });
}

double distance_to_segment(const glm::dvec2& p, const glm::dvec2& a, const glm::dvec2& b) {
    const glm::dvec2 along = b - a;
    const double square = glm::dot(along, along);
    const double t = square > 0 ? std::clamp(glm::dot(p - a, along) / square, 0.0, 1.0) : 0;
    return glm::distance(p, a + t * along);
}

/// Splats by the cube that they are in.
class CubeGrid {
  public:
    CubeGrid(double side, const glm::dvec3& corner) : side_(side), corner_(corner) {}
    void add(const glm::dvec3& p) { cubes_[key(cube(p))].push_back(p); }
    bool any_nearer(const glm::dvec3& p) const {
        const Cube at = cube(p);
        for (int n = 0; n < 27; ++n) {
            const Cube near{at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1};
            const auto found = cubes_.find(key(near));
            if (found == cubes_.end()) continue;
            for (const glm::dvec3& q : found->second)
                if (glm::distance(p, q) < side_) return true;
        }
        return false;
    }

  private:
    using Cube = std::array<std::int64_t, 3>;
    Cube cube(const glm::dvec3& p) const {
        const glm::dvec3 c = glm::floor((p - corner_) / side_);
        constexpr double kFar = 1 << 21;  // what is farther shares cubes, which is only slower
        return {static_cast<std::int64_t>(std::fmod(c.x, kFar)),
                static_cast<std::int64_t>(std::fmod(c.y, kFar)),
                static_cast<std::int64_t>(std::fmod(c.z, kFar))};
    }
    static std::uint64_t key(const Cube& c) {
        constexpr std::uint64_t kBits = (1U << 21) - 1;
        return (static_cast<std::uint64_t>(c[0]) & kBits) |
               (static_cast<std::uint64_t>(c[1]) & kBits) << 21 |
               (static_cast<std::uint64_t>(c[2]) & kBits) << 42;
    }
    double side_;
    glm::dvec3 corner_;
    std::unordered_map<std::uint64_t, std::vector<glm::dvec3>> cubes_;
};

}  // namespace

bool Region::contains(const glm::dvec3& p) const {
    const glm::dvec3 d = p - centre;
    if (shape == Shape::sphere) return glm::dot(d, d) <= half_size.x * half_size.x;
    return std::abs(d.x) <= half_size.x && std::abs(d.y) <= half_size.y &&
           std::abs(d.z) <= half_size.z;
}

SplatMask in_rectangle(const SplatModel& model, const Camera& camera, glm::dvec2 a, glm::dvec2 b) {
    const glm::dvec2 low = glm::min(a, b), high = glm::max(a, b);
    return on_screen(model, camera, [&](const glm::dvec2& p) {
        return p.x >= low.x && p.y >= low.y && p.x <= high.x && p.y <= high.y;
    });
}

SplatMask in_lasso(const SplatModel& model, const Camera& camera,
                   const std::vector<glm::dvec2>& lasso) {
    return on_screen(model, camera, [&](const glm::dvec2& p) {
        bool inside = false;
        for (std::size_t i = 0; i < lasso.size(); ++i) {
            const glm::dvec2 &a = lasso[i], &b = lasso[(i + 1) % lasso.size()];
            if ((a.y > p.y) == (b.y > p.y)) continue;
            if (p.x < a.x + (p.y - a.y) * (b.x - a.x) / (b.y - a.y)) inside = !inside;
        }
        return inside;
    });
}

SplatMask under_brush(const SplatModel& model, const Camera& camera,
                      const std::vector<glm::dvec2>& stroke, double radius) {
    return on_screen(model, camera, [&](const glm::dvec2& p) {
        for (std::size_t i = 0; i < stroke.size(); ++i)
            if (distance_to_segment(p, stroke[i > 0 ? i - 1 : 0], stroke[i]) <= radius) return true;
        return false;
    });
}

SplatMask in_region(const SplatModel& model, const Region& region) {
    return mask_of(model, [&](std::size_t i) { return region.contains(position_of(model, i)); });
}

SplatMask by_opacity(const SplatModel& model, double low, double high) {
    return mask_of(model, [&](std::size_t i) {
        const double opacity = sigmoid(double{model.opacity_logit[i]});
        return opacity >= low && opacity <= high;
    });
}

SplatMask by_scale(const SplatModel& model, double low, double high) {
    return mask_of(model, [&](std::size_t i) {
        const float* s = &model.log_scale[3 * i];
        const double scale = std::exp(double{std::max({s[0], s[1], s[2]})});
        return scale >= low && scale <= high;
    });
}

glm::dvec3 base_colour(const SplatModel& model, std::size_t splat) {
    const float* dc = &model.sh_dc[3 * splat];
    return 0.5 + kColourOfDc * glm::dvec3(dc[0], dc[1], dc[2]);
}

SplatMask by_colour(const SplatModel& model, const glm::dvec3& colour, double tolerance) {
    return mask_of(model, [&](std::size_t i) {
        const glm::dvec3 d = glm::abs(glm::clamp(base_colour(model, i), 0.0, 1.0) - colour);
        return std::max({d.x, d.y, d.z}) <= tolerance;
    });
}

SplatMask grown(const SplatModel& model, const SplatMask& mask, double distance) {
    DARB_CHECK(mask.size() == model.size() && distance > 0, "{} splats, {}, {}", model.size(),
               mask.size(), distance);
    CubeGrid grid(distance, model.origin);
    for (std::size_t i = 0; i < mask.size(); ++i)
        if (mask[i] != 0) grid.add(position_of(model, i));
    SplatMask result = mask;
    for (std::size_t i = 0; i < mask.size(); ++i)
        if (mask[i] == 0 && grid.any_nearer(position_of(model, i))) result[i] = 1;
    return result;
}

}  // namespace darb
