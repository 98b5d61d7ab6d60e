#include "tools/make_scene/textures.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace darb::make_scene {

namespace {

using glm::dvec2;
using glm::dvec3;

// A hash of one lattice point, in [0, 1).
double lattice(int x, int y, int z) {
    auto h = static_cast<std::uint32_t>(x) * 0x8da6b343u ^
             static_cast<std::uint32_t>(y) * 0xd8163841u ^
             static_cast<std::uint32_t>(z) * 0xcb1ab31fu;
    h = (h ^ (h >> 15)) * 0x2c1b3c6du;
    h = (h ^ (h >> 12)) * 0x297a2d39u;
    return (h ^ (h >> 15)) * 0x1p-32;
}

int floor_int(double v) {
    return static_cast<int>(std::floor(v));
}

double step(double low, double high, double v) {
    return glm::smoothstep(low, high, v);
}

dvec3 wood(const dvec3& p, const dvec3& a, const dvec3& b, double period) {
    const dvec3 bent = p + 0.5 * period * dvec3(fbm(p * 3.0, 3), fbm(p * 3.0 + 7.0, 3), 0);
    const double ring = glm::length(dvec2(bent.y + 0.4, bent.z + 0.7)) / period;
    const double grain = fbm(dvec3(p.x * 3, p.y * 40, p.z * 40), 2);
    const double saw = ring - std::floor(ring);
    return glm::mix(a, b, std::clamp(0.75 * saw * saw + 0.35 * (grain - 0.3), 0.0, 1.0));
}

dvec3 marble(const dvec3& p, const dvec3& a, const dvec3& b, double period) {
    const double phase = (p.x + 0.6 * p.y + 0.8 * p.z) / period + 2.2 * fbm(p / period, 4);
    const double vein = std::pow(std::abs(std::sin(0.5 * kTau * phase)), 0.35);
    return glm::mix(b, a, vein) * (0.85 + 0.2 * fbm(p * 4.0 / period, 2));
}

dvec3 dots(const dvec3& p, const dvec3& n, const dvec3& a, const dvec3& b, double period) {
    const dvec3 size = glm::abs(n);
    const dvec2 q = size.x > size.y && size.x > size.z ? dvec2(p.y, p.z)
                    : size.y > size.z                  ? dvec2(p.x, p.z)
                                                       : dvec2(p.x, p.y);
    const dvec2 cell = glm::fract(q / period) - 0.5;
    return glm::length(cell) < 0.3 ? b : a;
}

// Stone tiles, each of its own shade, with grout between.
dvec3 tiles(const dvec3& p, const dvec3& a, const dvec3& b, double period) {
    const dvec2 q = dvec2(p) / period;
    const dvec2 edge = 0.5 - glm::abs(glm::fract(q) - 0.5);
    const double shade = lattice(floor_int(q.x), floor_int(q.y), 5);
    const bool odd = ((floor_int(q.x) + floor_int(q.y)) & 1) != 0;
    const double stain = 0.86 + 0.28 * fbm(p * 3.0, 3);
    const dvec3 stone = glm::mix(a, b, odd ? 0.75 + 0.25 * shade : 0.25 * shade) * stain;
    return glm::mix(dvec3(0.30, 0.28, 0.26), stone, step(0.02, 0.035, std::min(edge.x, edge.y)));
}

}  // namespace

double noise(const dvec3& p) {
    const int x = floor_int(p.x), y = floor_int(p.y), z = floor_int(p.z);
    dvec3 f = glm::fract(p);
    f = f * f * (3.0 - 2.0 * f);
    const auto edge = [&](int dy, int dz) {
        return glm::mix(lattice(x, y + dy, z + dz), lattice(x + 1, y + dy, z + dz), f.x);
    };
    return glm::mix(glm::mix(edge(0, 0), edge(1, 0), f.y), glm::mix(edge(0, 1), edge(1, 1), f.y),
                    f.z);
}

double fbm(dvec3 p, int octaves) {
    double sum = 0, weight = 0.5;
    for (int i = 0; i < octaves; ++i, weight *= 0.5, p = p * 2.03 + 11.7) sum += weight * noise(p);
    return sum;
}

dvec3 albedo(Texture texture, const dvec3& p, const dvec3& n, const dvec3& a, const dvec3& b,
             double period) {
    const double turn = std::atan2(p.y, p.x) / kTau + 0.5;
    switch (texture) {
        case Texture::plain:
            return a;
        case Texture::checker: {
            const dvec3 inner = p - 1e-4 * n;  // clear of the cell border on the face itself
            const int parity = floor_int(inner.x / period) + floor_int(inner.y / period) +
                               floor_int(inner.z / period);
            return (parity & 1) != 0 ? a : b;
        }
        case Texture::wood:
            return wood(p, a, b, period);
        case Texture::marble:
            return marble(p, a, b, period);
        case Texture::stripes:
            return std::fmod(turn / period, 1.0) < 0.5 ? a : b;
        case Texture::beach_ball: {
            const dvec3 colours[] = {
                a, {0.9, 0.88, 0.82}, b, {0.9, 0.88, 0.82}, {0.9, 0.62, 0.08}, {0.9, 0.88, 0.82}};
            if (std::abs(n.z) > 0.96) return colours[1];
            return colours[std::min(5, floor_int(turn * 6))];
        }
        case Texture::dots:
            return dots(p, n, a, b, period);
        case Texture::tiles:
            return tiles(p, a, b, period);
    }
    return a;
}

}  // namespace darb::make_scene
