// SPDX-License-Identifier: MIT
#include "engine/reference/blend.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <span>

namespace darb::reference {
namespace {

// Listing a splat too often costs time, and too rarely changes the image, so the bound is widened
// by more than the rounding of q. Blending tests every pixel again.
template <class T>
constexpr T kReachMargin = T(sizeof(T) == 8 ? 1e-9 : 1e-3);

template <class T>
T q_at(const ProjectedSplat<T>& s, T dx, T dy) {
    const T u = s.l11 * dx + s.l21 * dy;
    const T v = s.l22 * dy;
    return u * u + v * v;
}

/// The device's key for a depth, see shaders/lib/depth.glsl.
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

namespace {

// A splat as seen at a pixel.
template <class T>
struct Sample {
    T dx = 0, dy = 0;  // mean - pixel centre, px
    T u = 0, v = 0;    // whitened offset; q = u^2 + v^2
    T q = 0;
    T weight = 0;  // w(q)
    T alpha = 0;
    bool clamped = false;  // alpha is ALPHA_MAX
    size_t entry = 0;      // in the tile's list
};

/// Returns false where the splat is skipped.
template <class T>
bool sample_splat(const ProjectedSplat<T>& s, T x, T y, const KernelTable& kernel, T cutoff,
                  Sample<T>& sample) {
    sample.dx = s.mean_px.x - x;
    sample.dy = s.mean_px.y - y;
    sample.u = s.l11 * sample.dx + s.l21 * sample.dy;
    sample.v = s.l22 * sample.dy;
    sample.q = sample.u * sample.u + sample.v * sample.v;
    // Skips evaluating the kernel where the answer is clear; within the band, alpha decides.
    if (!(sample.q < s.reach * T(1.001) + T(1e-3))) {
        return false;
    }
    sample.weight = static_cast<T>(
        kernel.value(static_cast<double>(sample.q), static_cast<double>(s.exponent)));
    const T unclamped = s.opacity * sample.weight;
    sample.clamped = unclamped > T(ALPHA_MAX);
    sample.alpha = sample.clamped ? T(ALPHA_MAX) : unclamped;
    return sample.alpha >= cutoff && sample.alpha > 0;
}

template <class T>
std::vector<ProjectedSplat<T>> gather(const TileLists& lists, size_t tile,
                                      const std::vector<ProjectedSplat<T>>& splats) {
    std::vector<ProjectedSplat<T>> list;
    for (std::uint32_t k = lists.begin[tile]; k < lists.begin[tile + 1]; ++k) {
        list.push_back(splats[lists.splats[k]]);
    }
    return list;
}

/// Calls visit(x, y) for the pixels of a tile, row by row.
template <class Visit>
void for_each_pixel(const TileLists& lists, size_t tile, int width, int height,
                    const Visit& visit) {
    const int x0 = static_cast<int>(tile % lists.tiles_x) * kTileSize;
    const int y0 = static_cast<int>(tile / lists.tiles_x) * kTileSize;
    for (int y = y0; y < std::min(y0 + kTileSize, height); ++y) {
        for (int x = x0; x < std::min(x0 + kTileSize, width); ++x) {
            visit(x, y);
        }
    }
}

/// Calls blend(k, sample, T before) for each splat that the pixel blends; returns the final T.
template <class T, class Blend>
T walk_pixel(std::span<const ProjectedSplat<T>> list, int x, int y, const KernelTable& kernel,
             const RenderSettings& settings, const Blend& blend) {
    const T cutoff = T(settings.alpha_cutoff);
    const T stop = T(settings.transmittance_stop * (1 - TRANSMITTANCE_SLACK));
    T transmittance = 1;
    const auto goes_on = [&](const Sample<T>& sample) {
        const T next = transmittance * (1 - sample.alpha);
        if (next < stop) {
            return false;
        }
        blend(sample.entry, sample, transmittance);
        transmittance = next;
        return true;
    };
    const bool resort = settings.depth_order == DEPTH_ORDER_PIXEL;
    std::vector<std::pair<T, Sample<T>>> by_depth;  // held back for resorting by depth
    Sample<T> sample;
    for (size_t k = 0; k < list.size(); ++k) {
        if (!sample_splat(list[k], T(x) + T(0.5), T(y) + T(0.5), kernel, cutoff, sample)) {
            continue;
        }
        sample.entry = k;
        if (resort) {
            const T depth = list[k].depth - glm::dot(list[k].depth_slope, {sample.u, sample.v});
            const auto place =
                std::upper_bound(by_depth.begin(), by_depth.end(), depth,
                                 [](T d, const auto& held) { return d < held.first; });
            by_depth.insert(place, {depth, sample});
            if (settings.depth_window > 0 && by_depth.size() > settings.depth_window) {
                const Sample<T> nearest = by_depth.front().second;
                by_depth.erase(by_depth.begin());
                if (!goes_on(nearest)) {
                    return transmittance;
                }
            }
        } else if (!goes_on(sample)) {
            break;
        }
    }
    for (const auto& one : by_depth) {
        if (!goes_on(one.second)) {
            break;
        }
    }
    return transmittance;
}

template <class T>
void add_sample_gradient(const ProjectedSplat<T>& s, const Sample<T>& sample, T d_alpha,
                         const KernelTable& kernel, ProjectedGradient<T>& out) {
    if (sample.clamped) {
        return;
    }
    const auto q = static_cast<double>(sample.q), exponent = static_cast<double>(s.exponent);
    out.d_opacity += d_alpha * sample.weight;
    out.d_exponent += d_alpha * s.opacity * static_cast<T>(kernel.by_exponent(q, exponent));
    const T slope = static_cast<T>(kernel.slope(q, exponent));
    const T d_u = d_alpha * s.opacity * slope * 2 * sample.u;
    const T d_v = d_alpha * s.opacity * slope * 2 * sample.v;
    out.d_l11 += d_u * sample.dx;
    out.d_l21 += d_u * sample.dy;
    out.d_l22 += d_v * sample.dy;
    out.d_mean_px += Vec2<T>(d_u * s.l11, d_u * s.l21 + d_v * s.l22);
}

template <class T>
struct Blended {
    size_t entry;  // in the tile's list
    Sample<T> sample;
    T before;  // transmittance in front of the splat
};

template <class T>
Vec3<T> background_of(const RenderSettings& settings) {
    return {T(settings.background[0]), T(settings.background[1]), T(settings.background[2])};
}

/// dL/d(colour, 1 - T, sum of T alpha depth, sum of T alpha depth^2) of a pixel.
template <class T>
struct PixelGradient {
    Vec3<T> colour;
    T alpha = 0, depth = 0, square = 0;
};

/// Goes back to front over the splats that a pixel blended and calls visit(blended, dL/dalpha).
/// `behind` is the colour behind the splat and `open` the transmittance behind it, both as seen
/// through nothing, so that there is no division by 1 - alpha.
template <class T, class Visit>
void pixel_backward(std::span<const ProjectedSplat<T>> list, std::span<const Blended<T>> blended,
                    const PixelGradient<T>& d_pixel, const Vec3<T>& background,
                    const Visit& visit) {
    Vec3<T> behind = background;
    T open = 1, depth_behind = 0, square_behind = 0;
    for (size_t i = blended.size(); i-- > 0;) {
        const Blended<T>& b = blended[i];
        const ProjectedSplat<T>& s = list[b.entry];
        const T alpha = b.sample.alpha;
        const T square = s.depth * s.depth;
        visit(b, b.before * (glm::dot(d_pixel.colour, s.colour - behind) + d_pixel.alpha * open +
                             d_pixel.depth * (s.depth - depth_behind) +
                             d_pixel.square * (square - square_behind)));
        behind = alpha * s.colour + (1 - alpha) * behind;
        depth_behind = alpha * s.depth + (1 - alpha) * depth_behind;
        square_behind = alpha * square + (1 - alpha) * square_behind;
        open *= 1 - alpha;
    }
}

/// Calls visit(splat, blended, dL/dalpha, gradient of the pixel) for all that a tile's pixels
/// blended; returns dL/d(background).
template <class T, class Visit>
Vec3<T> tile_backward(const TileLists& lists, size_t tile,
                      const std::vector<ProjectedSplat<T>>& list, const KernelTable& kernel,
                      const RenderSettings& settings, const ImageGradient<T>& d_image,
                      const Visit& visit) {
    const Vec3<T> background = background_of<T>(settings);
    std::vector<Blended<T>> blended;
    Vec3<T> d_background(0);
    const auto pixel = [&](int x, int y) {
        blended.clear();
        const T transmittance = walk_pixel<T>(list, x, y, kernel, settings,
                                              [&](size_t k, const Sample<T>& sample, T before) {
                                                  blended.push_back({k, sample, before});
                                              });
        const Image<T>&d_rgb = d_image.colour, &d_alpha = d_image.alpha, &d_depth = d_image.depth;
        PixelGradient<T> d_pixel{{d_rgb.at(x, y, 0), d_rgb.at(x, y, 1), d_rgb.at(x, y, 2)}};
        if (!d_alpha.data.empty()) d_pixel.alpha = d_alpha.at(x, y, 0);
        if (!d_depth.data.empty()) d_pixel.depth = d_depth.at(x, y, 0);
        if (d_depth.channels > 1) d_pixel.square = d_depth.at(x, y, 1);
        d_background += d_pixel.colour * transmittance;
        pixel_backward<T>(list, blended, d_pixel, background,
                          [&](const Blended<T>& b, T d_blended) { visit(b, d_blended, d_pixel); });
    };
    for_each_pixel(lists, tile, d_image.colour.width, d_image.colour.height, pixel);
    return d_background;
}

}  // namespace

template <class T>
void blend_tile(const TileLists& lists, size_t tile, const std::vector<ProjectedSplat<T>>& splats,
                const KernelTable& kernel, const RenderSettings& settings, BlendImages<T>& images) {
    const std::vector<ProjectedSplat<T>> list = gather(lists, tile, splats);
    const Vec3<T> background = background_of<T>(settings);
    const auto blend_pixel = [&](int x, int y) {
        Vec3<T> colour(0);
        T depth = 0, square = 0;
        std::int32_t count = 0;
        const T transmittance = walk_pixel<T>(list, x, y, kernel, settings,
                                              [&](size_t k, const Sample<T>& sample, T before) {
                                                  colour += before * sample.alpha * list[k].colour;
                                                  const T z = list[k].depth;
                                                  depth += before * sample.alpha * z;
                                                  square += before * sample.alpha * z * z;
                                                  ++count;
                                              });
        colour += transmittance * background;
        for (int c = 0; c < 3; ++c) {
            images.colour.at(x, y, c) = colour[c];
        }
        images.transmittance.at(x, y, 0) = transmittance;
        images.depth.at(x, y, 0) = depth;
        if (!images.square.data.empty()) images.square.at(x, y, 0) = square;
        images.contributions.at(x, y, 0) = count;
    };
    for_each_pixel(lists, tile, images.colour.width, images.colour.height, blend_pixel);
}

template <class T>
Vec3<T> blend_tile_backward(const TileLists& lists, size_t tile,
                            const std::vector<ProjectedSplat<T>>& splats, const KernelTable& kernel,
                            const RenderSettings& settings, const ImageGradient<T>& d_image,
                            ProjectedGradient<T>* intersections) {
    const std::vector<ProjectedSplat<T>> list = gather(lists, tile, splats);
    return tile_backward<T>(lists, tile, list, kernel, settings, d_image,
                            [&](const Blended<T>& b, T d_alpha, const PixelGradient<T>& d_pixel) {
                                ProjectedGradient<T>& to = intersections[b.entry];
                                to.d_depth +=
                                    (d_pixel.depth + 2 * d_pixel.square * list[b.entry].depth) *
                                    (b.before * b.sample.alpha);
                                to.d_colour += d_pixel.colour * (b.before * b.sample.alpha);
                                add_sample_gradient(list[b.entry], b.sample, d_alpha, kernel, to);
                            });
}

template <class T>
void add_tile_profile(const TileLists& lists, size_t tile,
                      const std::vector<ProjectedSplat<T>>& splats, const KernelTable& kernel,
                      const RenderSettings& settings, const ImageGradient<T>& d_image,
                      const ProfileTarget<T>& to) {
    const std::vector<ProjectedSplat<T>> list = gather(lists, tile, splats);
    tile_backward<T>(lists, tile, list, kernel, settings, d_image,
                     [&](const Blended<T>& b, T d_alpha, const PixelGradient<T>&) {
                         if (b.sample.clamped) return;
                         const T u = std::max(1 - b.sample.q / to.support, T(0));
                         const T angle = std::acos(2 * std::sqrt(u) - 1);
                         for (size_t k = 0; k < to.sums.size(); ++k)
                             to.sums[k] += d_alpha * list[b.entry].opacity * std::cos(T(k) * angle);
                     });
}

#define DARB_INSTANTIATE(T)                                                                   \
    template void blend_tile(const TileLists&, size_t, const std::vector<ProjectedSplat<T>>&, \
                             const KernelTable&, const RenderSettings&, BlendImages<T>&);     \
    template Vec3<T> blend_tile_backward(                                                     \
        const TileLists&, size_t, const std::vector<ProjectedSplat<T>>&, const KernelTable&,  \
        const RenderSettings&, const ImageGradient<T>&, ProjectedGradient<T>*);               \
    template void add_tile_profile(                                                           \
        const TileLists&, size_t, const std::vector<ProjectedSplat<T>>&, const KernelTable&,  \
        const RenderSettings&, const ImageGradient<T>&, const ProfileTarget<T>&);
DARB_INSTANTIATE(double)
DARB_INSTANTIATE(float)
#undef DARB_INSTANTIATE

}  // namespace darb::reference
