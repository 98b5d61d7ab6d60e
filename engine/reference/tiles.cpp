#include "engine/reference/tiles.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace darb::reference {
namespace {

// Listing a splat too often costs time, too rarely changes the image: the bound is widened by more
// than the rounding of q. Blending tests every pixel again.
template <class T>
constexpr T kReachMargin = T(sizeof(T) == 8 ? 1e-9 : 1e-3);

template <class T>
T q_at(const ProjectedSplat<T>& s, T dx, T dy) {
    const T u = s.l11 * dx + s.l21 * dy;
    const T v = s.l22 * dy;
    return u * u + v * v;
}

/// The device's key of a depth, see shaders/lib/depth.glsl.
std::uint32_t depth_key_16(float depth, float near_z) {
    const std::uint32_t above =
        std::bit_cast<std::uint32_t>(depth) - std::bit_cast<std::uint32_t>(near_z);
    return std::min(above >> DEPTH_KEY_SHIFT, (1U << DEPTH_KEY_BITS) - 1);
}

struct TileRange {
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0;  // tiles, ends exclusive
};

/// Tiles that the bounding box of the ellipse q < reach overlaps.
template <class T>
TileRange tile_range(const ProjectedSplat<T>& s, int tiles_x, int tiles_y) {
    const auto bound = [](double px, int tiles) {
        return static_cast<int>(std::clamp(px / kTileSize, 0.0, double(tiles)));
    };
    const double reach = static_cast<double>(s.reach * (1 + kReachMargin<T>));
    const double rx = std::sqrt(reach * static_cast<double>(s.cov_xx));
    const double ry = std::sqrt(reach * static_cast<double>(s.cov_yy));
    const double x = static_cast<double>(s.mean_px.x), y = static_cast<double>(s.mean_px.y);
    return {bound(std::floor(x - rx), tiles_x), bound(std::floor(y - ry), tiles_y),
            bound(std::ceil(x + rx) + kTileSize - 1, tiles_x),
            bound(std::ceil(y + ry) + kTileSize - 1, tiles_y)};
}

/// Calls visit(tile) for every tile that the splat touches.
template <class T, class Visit>
void for_each_tile(const ProjectedSplat<T>& s, int width, int height, int tiles_x, int tiles_y,
                   const Visit& visit) {
    const TileRange range = tile_range(s, tiles_x, tiles_y);
    for (int ty = range.y0; ty < range.y1; ++ty) {
        for (int tx = range.x0; tx < range.x1; ++tx) {
            const int x0 = tx * kTileSize, y0 = ty * kTileSize;
            const int x1 = std::min(x0 + kTileSize, width), y1 = std::min(y0 + kTileSize, height);
            if (smallest_q(s, x0, y0, x1, y1) <= s.reach * (1 + kReachMargin<T>)) {
                visit(static_cast<size_t>(ty) * tiles_x + tx);
            }
        }
    }
}

}  // namespace

template <class T>
std::vector<std::uint32_t> depth_order(const std::vector<ProjectedSplat<T>>& splats,
                                       const RenderSettings& settings) {
    const auto key = [&](std::uint32_t i) {
        return settings.depth_order == DEPTH_ORDER_CENTRE16
                   ? T(depth_key_16(static_cast<float>(splats[i].depth),
                                    static_cast<float>(settings.near_z)))
                   : splats[i].depth;
    };
    std::vector<std::uint32_t> order;
    for (size_t i = 0; i < splats.size(); ++i) {
        if (splats[i].cull == Cull::none) {
            order.push_back(static_cast<std::uint32_t>(i));
        }
    }
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
    return order;
}

template <class T>
T smallest_q(const ProjectedSplat<T>& s, int x0, int y0, int x1, int y1) {
    // Offsets mean - centre over the box, as in blending.
    const T dx_min = s.mean_px.x - (T(x1) - T(0.5)), dx_max = s.mean_px.x - (T(x0) + T(0.5));
    const T dy_min = s.mean_px.y - (T(y1) - T(0.5)), dy_max = s.mean_px.y - (T(y0) + T(0.5));
    const T dx = std::clamp(T(0), dx_min, dx_max), dy = std::clamp(T(0), dy_min, dy_max);
    if (dx == 0 && dy == 0) {
        return 0;
    }
    // q is convex with its minimum outside the box, so the constrained one lies on a facing edge.
    T smallest = std::numeric_limits<T>::infinity();
    if (dx != 0) {
        const T best = -s.l11 * s.l21 * dx / (s.l21 * s.l21 + s.l22 * s.l22);
        smallest = std::min(smallest, q_at(s, dx, std::clamp(best, dy_min, dy_max)));
    }
    if (dy != 0) {
        const T best = -s.l21 * dy / s.l11;
        smallest = std::min(smallest, q_at(s, std::clamp(best, dx_min, dx_max), dy));
    }
    return smallest;
}

template <class T>
TileLists make_tile_lists(int width, int height, std::vector<ProjectedSplat<T>>& splats,
                          const RenderSettings& settings) {
    TileLists lists;
    lists.tiles_x = (width + kTileSize - 1) / kTileSize;
    lists.tiles_y = (height + kTileSize - 1) / kTileSize;
    struct Intersection {
        std::uint32_t tile, splat;
    };
    std::vector<Intersection> intersections;
    lists.begin.assign(lists.tile_count() + 1, 0);
    for (const std::uint32_t i : depth_order(splats, settings)) {
        const size_t before = intersections.size();
        for_each_tile(splats[i], width, height, lists.tiles_x, lists.tiles_y, [&](size_t tile) {
            intersections.push_back({static_cast<std::uint32_t>(tile), i});
            ++lists.begin[tile + 1];
        });
        if (intersections.size() == before) {
            splats[i].cull = Cull::outside;
        }
    }
    for (size_t tile = 0; tile < lists.tile_count(); ++tile) {
        lists.begin[tile + 1] += lists.begin[tile];
    }
    std::vector<std::uint32_t> next(lists.begin.begin(), lists.begin.end() - 1);
    lists.splats.resize(intersections.size());
    for (const Intersection& intersection : intersections) {
        lists.splats[next[intersection.tile]++] = intersection.splat;
    }
    return lists;
}

#define DARB_INSTANTIATE(T)                                                                \
    template std::vector<std::uint32_t> depth_order(const std::vector<ProjectedSplat<T>>&, \
                                                    const RenderSettings&);                \
    template T smallest_q(const ProjectedSplat<T>&, int, int, int, int);                   \
    template TileLists make_tile_lists(int, int, std::vector<ProjectedSplat<T>>&,          \
                                       const RenderSettings&);
DARB_INSTANTIATE(double)
DARB_INSTANTIATE(float)
#undef DARB_INSTANTIATE

}  // namespace darb::reference
