// SPDX-License-Identifier: MIT
#include "engine/mesh/texture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/on_threads.h"
#include "engine/mesh/topology.h"

namespace darb {

namespace {

using glm::dvec2;
using glm::dvec3;

// A triangle on texels.

struct FlatFace {
    std::array<dvec2, 3> at;  // px

    dvec2 low() const { return glm::min(glm::min(at[0], at[1]), at[2]); }
    dvec2 high() const { return glm::max(glm::max(at[0], at[1]), at[2]); }
    double twice_area() const {
        const dvec2 a = at[1] - at[0], b = at[2] - at[0];
        return a.x * b.y - a.y * b.x;
    }
    /// Calls visit(x, y, weights) for each texel whose middle has weights of at least `least`,
    /// until it returns false; returns whether it never did.
    template <class Visit>
    bool for_each_texel(double least, const Visit& visit) const {
        const double area = twice_area();
        if (!(std::abs(area) > 1e-12)) return true;
        const dvec2 from = glm::floor(low()), to = glm::ceil(high());
        for (int y = int(from.y); y < int(to.y); ++y)
            for (int x = int(from.x); x < int(to.x); ++x) {
                const dvec2 p(x + 0.5, y + 0.5);
                dvec3 weight;
                for (int c = 0; c < 3; ++c) {
                    const dvec2 a = at[std::size_t(c + 1) % 3] - p,
                                b = at[std::size_t(c + 2) % 3] - p;
                    weight[c] = (a.x * b.y - a.y * b.x) / area;
                }
                if (weight.x < least || weight.y < least || weight.z < least) continue;
                if (!visit(x, y, weight)) return false;
            }
        return true;
    }
};

// Charts.

/// The axis of the normal's largest component, 0 to 2, and 3 more where it is negative.
int side_of(const dvec3& normal) {
    int axis = 0;
    for (int other = 1; other < 3; ++other)
        if (std::abs(normal[other]) > std::abs(normal[axis])) axis = other;
    return normal[axis] < 0 ? axis + 3 : axis;
}

dvec2 flattened(const glm::vec3& p, int side, double texel) {
    const int axis = side % 3, u = (axis + 1) % 3, v = (axis + 2) % 3;
    const dvec2 flat(p[u] / texel, p[v] / texel);
    return side < 3 ? flat : dvec2(flat.y, flat.x);  // seen from outside, never mirrored
}

struct Chart {
    std::vector<std::uint32_t> faces;
    int side = 0;
    dvec2 low{0.0}, high{0.0};  // px, before it is placed
    std::size_t page = 0;
    glm::ivec2 place{0};  // of its gutter's corner on the page, px
    glm::ivec2 size{0};   // with its gutter, px
};

class ChartMaker {
  public:
    ChartMaker(const TriangleMesh& mesh, const AtlasOptions& options)
        : mesh_(mesh),
          options_(options),
          most_(options.page_side - 2 * options.gutter - 2),
          taken_(std::size_t(options.page_side) * std::size_t(options.page_side)) {}

    std::vector<Chart> make() {
        const std::vector<std::uint32_t> twin = pair_half_edges(mesh_).twin;
        std::vector<int> side(mesh_.face_count());
        for (std::size_t f = 0; f < side.size(); ++f) side[f] = side_of(face_cross(mesh_, f));
        std::vector<bool> done(mesh_.face_count(), false);
        std::vector<Chart> charts;
        for (std::uint32_t f = 0; f < mesh_.face_count(); ++f) {
            if (done[f]) continue;
            Chart& chart = charts.emplace_back();
            chart.side = side[f];
            chart.low = dvec2(std::numeric_limits<double>::infinity());
            chart.high = -chart.low;
            const auto number = static_cast<std::uint32_t>(charts.size() - 1);
            if (!take(f, number, chart)) refuse(f, side[f]);
            done[f] = true;
            for (std::size_t i = 0; i < chart.faces.size(); ++i)
                for (std::uint32_t half = 3 * chart.faces[i]; half < 3 * chart.faces[i] + 3;
                     ++half) {
                    if (twin[half] == kNoHalfEdge) continue;
                    const std::uint32_t other = twin[half] / 3;
                    if (done[other] || side[other] != chart.side) continue;
                    done[other] = take(other, number, chart);
                }
        }
        return charts;
    }

    FlatFace flat(std::uint32_t face, int side) const {
        FlatFace flat_face;
        for (std::size_t c = 0; c < 3; ++c)
            flat_face.at[c] = flattened(mesh_.position[mesh_.face[face][c]], side, options_.texel);
        return flat_face;
    }

  private:
    /// What a texel of the chart that is made shows: how far along the axis, in texels.
    struct Taken {
        std::uint32_t chart = kNoHalfEdge;
        float depth = 0;
    };
    /// A chart is smaller than a page, so its texels have places of their own modulo that.
    Taken& taken_at(int x, int y) {
        const int side = options_.page_side;
        return taken_[std::size_t((y % side + side) % side) * std::size_t(side) +
                      std::size_t((x % side + side) % side)];
    }

    /// Whether a texel beside this one shows another layer of the surface, which would bleed into
    /// it. Within a layer, faces of a chart rise by sqrt(2) for each texel at most.
    bool beside_another_layer(int x, int y, float depth, std::uint32_t chart) {
        constexpr float kSameLayer = 3;  // texels; two of them meet at a corner
        for (int v = y - 1; v <= y + 1; ++v)
            for (int u = x - 1; u <= x + 1; ++u)
                if (const Taken& other = taken_at(u, v);
                    other.chart == chart && std::abs(other.depth - depth) > kSameLayer)
                    return true;
        return false;
    }

    /// Adds the face where the chart stays within a page and no texel has been taken by another.
    bool take(std::uint32_t face, std::uint32_t number, Chart& chart) {
        const FlatFace one = flat(face, chart.side);
        const dvec2 low = glm::min(chart.low, one.low()), high = glm::max(chart.high, one.high());
        const dvec2 extent = glm::ceil(high) - glm::floor(low);
        if (!(extent.x <= most_ && extent.y <= most_)) return false;
        dvec3 depths;
        for (std::size_t c = 0; c < 3; ++c)
            depths[int(c)] = mesh_.position[mesh_.face[face][c]][chart.side % 3] / options_.texel;
        const auto depth_at = [&](const dvec3& weight) {
            return static_cast<float>(glm::dot(depths, weight));
        };
        constexpr double kWithin = 1e-6;  // not those on the border, which neighbours share
        const bool free = one.for_each_texel(kWithin, [&](int x, int y, const dvec3& weight) {
            return taken_at(x, y).chart != number &&
                   !beside_another_layer(x, y, depth_at(weight), number);
        });
        if (!free) return false;
        one.for_each_texel(kWithin, [&](int x, int y, const dvec3& weight) {
            taken_at(x, y) = {number, depth_at(weight)};
            return true;
        });
        chart.low = low;
        chart.high = high;
        chart.faces.push_back(face);
        return true;
    }

    [[noreturn]] void refuse(std::uint32_t face, int side) const {
        const FlatFace one = flat(face, side);
        const dvec2 extent = glm::ceil(one.high()) - glm::floor(one.low());
        const double more = std::max(extent.x, extent.y) / most_;
        throw Error("texture",
                    fmt::format("face {} is {} x {} texels, and a page has {}", face, extent.x,
                                extent.y, options_.page_side),
                    fmt::format("Take texels of at least {:.3g} (--texel), or keep more faces.",
                                1.01 * more * options_.texel));
    }

    const TriangleMesh& mesh_;
    const AtlasOptions& options_;
    double most_;               // px of a chart without its gutter
    std::vector<Taken> taken_;  // [page_side][page_side]
};

/// Places the charts on shelves, the highest first; returns the pages' sizes.
std::vector<glm::ivec2> place_charts(const AtlasOptions& options, std::vector<Chart>& charts) {
    for (Chart& chart : charts)
        chart.size = glm::ivec2(glm::ceil(chart.high) - glm::floor(chart.low)) +
                     glm::ivec2(2 * options.gutter);
    std::vector<std::size_t> order(charts.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return charts[a].size.y > charts[b].size.y;
    });
    std::vector<glm::ivec2> pages;
    glm::ivec2 at(0);
    int shelf = 0;
    for (const std::size_t i : order) {
        Chart& chart = charts[i];
        if (at.x + chart.size.x > options.page_side) at = {0, at.y + shelf};
        if (at.x == 0) shelf = chart.size.y;
        if (pages.empty() || at.y + chart.size.y > options.page_side) {
            pages.emplace_back(0);
            at = glm::ivec2(0);
            shelf = chart.size.y;
        }
        chart.page = pages.size() - 1;
        chart.place = at;
        at.x += chart.size.x;
        pages.back() = glm::max(pages.back(), chart.place + chart.size);
    }
    return pages;
}

// Painting.

/// A texel to paint, and where it is on the surface.
struct TexelList {
    std::vector<SurfacePoint> point;
    std::vector<std::uint32_t> page;
    std::vector<std::size_t> texel;  // of the page
};

class Painter {
  public:
    Painter(const TriangleMesh& mesh, MeshTexture& texture) : mesh_(mesh), texture_(texture) {
        for (const ImageU8& image : texture.image)
            painted_.emplace_back(std::size_t(image.width) * std::size_t(image.height), 0);
    }

    /// Paints the faces that `wanted` names, in their order.
    template <class Wanted>
    void paint(const Wanted& wanted, const ColourSource& source) {
        for (std::uint32_t f = 0; f < mesh_.face_count(); ++f) {
            if (!wanted(f)) continue;
            add_face(f);
            if (list_.point.size() >= kBatch) flush(source);
        }
        flush(source);
    }

    void finish(int gutter) {
        for (std::size_t page = 0; page < painted_.size(); ++page)
            for (int step = 0; step < gutter; ++step) grow(page);
    }

  private:
    static constexpr std::size_t kBatch = std::size_t{1} << 18;

    void add_face(std::uint32_t f) {
        const std::uint32_t page = texture_.page[f];
        const ImageU8& image = texture_.image[page];
        FlatFace flat;
        for (std::size_t c = 0; c < 3; ++c)
            flat.at[c] = dvec2(texture_.uv[f][c]) * dvec2(image.width, image.height);
        bool any = false;
        const auto add = [&](int x, int y, const dvec3& weight) {
            any = true;
            if (x < 0 || y < 0 || x >= image.width || y >= image.height) return true;
            const std::size_t texel = std::size_t(y) * std::size_t(image.width) + std::size_t(x);
            if (painted_[page][texel]) return true;
            painted_[page][texel] = 1;
            list_.point.push_back(surface_point(f, weight));
            list_.page.push_back(page);
            list_.texel.push_back(texel);
            return true;
        };
        constexpr double kOnBorder = -1e-9;
        flat.for_each_texel(kOnBorder, add);
        if (any) return;
        const dvec2 middle = (flat.at[0] + flat.at[1] + flat.at[2]) / 3.0;
        add(int(std::floor(middle.x)), int(std::floor(middle.y)), dvec3(1.0 / 3));
    }

    SurfacePoint surface_point(std::uint32_t f, const dvec3& weight) const {
        SurfacePoint point;
        point.face = f;
        dvec3 position(0.0), normal(0.0);
        for (std::size_t c = 0; c < 3; ++c) {
            const std::uint32_t v = mesh_.face[f][c];
            position += weight[int(c)] * dvec3(mesh_.position[v]);
            if (!mesh_.normal.empty()) normal += weight[int(c)] * dvec3(mesh_.normal[v]);
        }
        if (!(glm::length(normal) > 1e-6)) normal = face_cross(mesh_, f);
        point.position = glm::vec3(position);
        point.normal = glm::vec3(normal / std::max(glm::length(normal), 1e-300));
        return point;
    }

    void flush(const ColourSource& source) {
        std::vector<glm::u8vec3> colours(list_.point.size(), glm::u8vec3(0));
        if (!colours.empty()) source(list_.point, colours);
        for (std::size_t i = 0; i < colours.size(); ++i) {
            std::uint8_t* texel = &texture_.image[list_.page[i]].data[3 * list_.texel[i]];
            for (int c = 0; c < 3; ++c) texel[c] = colours[i][c];
        }
        list_ = {};
    }

    /// Paints the texels beside painted ones with the mean of these.
    void grow(std::size_t page) {
        ImageU8& image = texture_.image[page];
        std::vector<std::uint8_t> next = painted_[page];
        for (int y = 0; y < image.height; ++y)
            for (int x = 0; x < image.width; ++x) {
                const std::size_t texel =
                    std::size_t(y) * std::size_t(image.width) + std::size_t(x);
                if (painted_[page][texel]) continue;
                glm::ivec3 sum(0);
                int count = 0;
                for (int v = std::max(y - 1, 0); v <= std::min(y + 1, image.height - 1); ++v)
                    for (int u = std::max(x - 1, 0); u <= std::min(x + 1, image.width - 1); ++u) {
                        const std::size_t other =
                            std::size_t(v) * std::size_t(image.width) + std::size_t(u);
                        if (!painted_[page][other]) continue;
                        for (int c = 0; c < 3; ++c)
                            sum[c] += image.data[3 * other + std::size_t(c)];
                        ++count;
                    }
                if (count == 0) continue;
                next[texel] = 1;
                for (int c = 0; c < 3; ++c)
                    image.data[3 * texel + std::size_t(c)] =
                        static_cast<std::uint8_t>((sum[c] + count / 2) / count);
            }
        painted_[page] = std::move(next);
    }

    const TriangleMesh& mesh_;
    MeshTexture& texture_;
    std::vector<std::vector<std::uint8_t>> painted_;  // [pages][texels]
    TexelList list_;
};

// Photos.

dvec3 world_of(const TriangleMesh& mesh, const glm::vec3& p) {
    return dvec3(mesh.origin[0], mesh.origin[1], mesh.origin[2]) + dvec3(p);
}

/// Pixel and depth; nothing behind the camera.
std::optional<dvec3> projected(const Camera& camera, const dvec3& world) {
    const dvec3 p = camera.rotation * world + camera.translation;
    if (!(p.z > 0)) return std::nullopt;
    return dvec3(camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy, p.z);
}

bool in_frame(const Camera& camera, const dvec3& pixel) {
    return pixel.x >= 0.5 && pixel.y >= 0.5 && pixel.x <= camera.width - 0.5 &&
           pixel.y <= camera.height - 0.5;
}

/// The mean of the normals at the face's corners, which noise in the surface turns less than its
/// own; that where the mesh has none.
dvec3 smooth_normal(const TriangleMesh& mesh, std::uint32_t face) {
    if (mesh.normal.empty()) return glm::normalize(face_cross(mesh, face));
    dvec3 sum(0.0);
    for (const std::uint32_t v : mesh.face[face]) sum += dvec3(mesh.normal[v]);
    const double length = glm::length(sum);
    return length > 0 ? sum / length : glm::normalize(face_cross(mesh, face));
}

/// cos^2/z^2 of the view for the face; 0 where it does not see it.
double score_of(const TriangleMesh& mesh, std::uint32_t face, const PhotoViews& views,
                std::size_t view) {
    const Camera& camera = views.cameras[view];
    dvec3 middle(0.0);
    for (const std::uint32_t v : mesh.face[face]) {
        const dvec3 world = world_of(mesh, mesh.position[v]);
        const auto pixel = projected(camera, world);
        if (!pixel || !in_frame(camera, *pixel)) return 0;
        middle += world / 3.0;
    }
    const dvec3 to = camera.centre() - middle;
    const double cosine = glm::dot(smooth_normal(mesh, face), to) / glm::length(to);
    constexpr double kGrazing = 0.1;  // 84 degrees
    if (!(cosine > kGrazing) || !views.sees(view, middle)) return 0;
    const double z = projected(camera, middle)->z;
    return cosine * cosine / (z * z);
}

struct Candidate {
    std::uint32_t view;
    double cost;  // 0 for the best view, towards 1 for a bad one
};

std::vector<Candidate> candidates_of(const TriangleMesh& mesh, std::uint32_t face,
                                     const PhotoViews& views) {
    constexpr std::size_t kMostCandidates = 16;
    std::vector<Candidate> found;
    for (std::uint32_t view = 0; view < views.cameras.size(); ++view)
        if (const double score = score_of(mesh, face, views, view); score > 0)
            found.push_back({view, -score});
    std::stable_sort(found.begin(), found.end(),
                     [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; });
    if (found.size() > kMostCandidates) found.resize(kMostCandidates);
    const double best = found.empty() ? 1 : -found[0].cost;
    for (Candidate& candidate : found) candidate.cost = 1 + candidate.cost / best;
    return found;
}

/// The choice of a view for each face that has candidates, and moves that make it cheaper.
class Labelling {
  public:
    Labelling(const TriangleMesh& mesh, const PhotoViews& views, double smoothing)
        : smoothing_(smoothing),
          twin_(pair_half_edges(mesh).twin),
          candidates(mesh.face_count()),
          view(mesh.face_count(), kNoPhoto) {
        in_pieces(mesh.face_count(), 256, [&](std::size_t first, std::size_t count) {
            for (std::size_t f = first; f < first + count; ++f)
                candidates[f] = candidates_of(mesh, static_cast<std::uint32_t>(f), views);
        });
        for (std::size_t f = 0; f < view.size(); ++f)
            if (!candidates[f].empty()) view[f] = candidates[f][0].view;
    }

    /// Gives each face in turn its cheapest view. Returns whether one changed.
    bool move_faces() {
        bool changed = false;
        for (std::uint32_t f = 0; f < view.size(); ++f) {
            double least = std::numeric_limits<double>::infinity();
            std::uint32_t best = view[f];
            for (const Candidate& candidate : candidates[f]) {
                const double cost = candidate.cost + smoothing_ * differing(f, candidate.view);
                if (cost >= least) continue;
                least = cost;
                best = candidate.view;
            }
            changed |= best != view[f];
            view[f] = best;
        }
        return changed;
    }

    /// Gives each patch, the connected faces of a view, a neighbour's view where all of it can have
    /// that and it costs less. Returns whether one changed.
    bool move_patches() {
        std::vector<bool> done(view.size(), false);
        bool changed = false;
        for (std::uint32_t f = 0; f < view.size(); ++f) {
            if (done[f] || view[f] == kNoPhoto) continue;
            std::vector<std::uint32_t> patch{f}, around;  // views beside it
            done[f] = true;
            for (std::size_t i = 0; i < patch.size(); ++i)
                for_each_neighbour(patch[i], [&](std::uint32_t other) {
                    if (view[other] != view[f])
                        around.push_back(view[other]);
                    else if (!done[other]) {
                        done[other] = true;
                        patch.push_back(other);
                    }
                });
            changed |= move_patch(patch, around);
        }
        return changed;
    }

    std::size_t seams() const {
        std::size_t count = 0;
        for (std::uint32_t half = 0; half < twin_.size(); ++half)
            if (twin_[half] != kNoHalfEdge && half < twin_[half])
                count += view[half / 3] != view[twin_[half] / 3];
        return count;
    }

  private:
    /// Neighbours that a photo sees.
    template <class Visit>
    void for_each_neighbour(std::uint32_t f, const Visit& visit) const {
        for (std::uint32_t half = 3 * f; half < 3 * f + 3; ++half)
            if (twin_[half] != kNoHalfEdge && view[twin_[half] / 3] != kNoPhoto)
                visit(twin_[half] / 3);
    }
    int differing(std::uint32_t f, std::uint32_t with) const {
        int count = 0;
        for_each_neighbour(f, [&](std::uint32_t other) { count += view[other] != with; });
        return count;
    }
    double cost_of(std::uint32_t f, std::uint32_t with) const {
        for (const Candidate& candidate : candidates[f])
            if (candidate.view == with) return candidate.cost;
        return std::numeric_limits<double>::infinity();
    }

    bool move_patch(const std::vector<std::uint32_t>& patch, std::vector<std::uint32_t>& around) {
        const std::uint32_t own = view[patch[0]];
        std::sort(around.begin(), around.end());
        double least = 0;  // against leaving it
        std::uint32_t best = own;
        for (std::size_t i = 0; i < around.size(); ++i) {
            if (i > 0 && around[i] == around[i - 1]) continue;
            // The border to that view goes; the borders to others stay.
            const auto edges = std::count(around.begin(), around.end(), around[i]);
            double change = -smoothing_ * static_cast<double>(edges);
            for (const std::uint32_t f : patch) change += cost_of(f, around[i]) - cost_of(f, own);
            if (change >= least - 1e-9) continue;
            least = change;
            best = around[i];
        }
        for (const std::uint32_t f : patch) view[f] = best;
        return best != own;
    }

    double smoothing_;
    std::vector<std::uint32_t> twin_;

  public:
    std::vector<std::vector<Candidate>> candidates;  // [F]
    std::vector<std::uint32_t> view;                 // [F]
};

dvec3 bilinear(const ImageU8& photo, double px, double py) {
    const double x = std::clamp(px - 0.5, 0.0, photo.width - 1.0),
                 y = std::clamp(py - 0.5, 0.0, photo.height - 1.0);
    const int x0 = int(x), y0 = int(y), x1 = std::min(x0 + 1, photo.width - 1),
              y1 = std::min(y0 + 1, photo.height - 1);
    const double u = x - x0, v = y - y0;
    dvec3 colour;
    for (int c = 0; c < 3; ++c) {
        const double top = (1 - u) * photo.at(x0, y0, c) + u * photo.at(x1, y0, c),
                     bottom = (1 - u) * photo.at(x0, y1, c) + u * photo.at(x1, y1, c);
        colour[c] = (1 - v) * top + v * bottom;
    }
    return colour;
}

/// What is added to the photo at a point of a face, between the face's corners.
dvec3 added_at(const TriangleMesh& mesh, const SeamLevels& levels, const SurfacePoint& point) {
    if (levels.added.empty()) return dvec3(0.0);
    const auto& face = mesh.face[point.face];
    const dvec3 normal = face_cross(mesh, point.face), p(point.position);
    const double area = glm::dot(normal, normal);
    if (!(area > 0)) return dvec3(levels.added[point.face][0]);
    dvec3 sum(0.0);
    for (std::size_t c = 0; c < 3; ++c) {
        const dvec3 a(mesh.position[face[(c + 1) % 3]]), b(mesh.position[face[(c + 2) % 3]]);
        const double weight = glm::dot(glm::cross(a - p, b - p), normal) / area;
        sum += weight * dvec3(levels.added[point.face][c]);
    }
    return sum;
}

glm::u8vec3 in_levels(const dvec3& colour) {
    return glm::u8vec3(glm::round(glm::clamp(colour, 0.0, 255.0)));
}

/// The colour of the face's vertices, weighted by how near they are; grey without any.
glm::u8vec3 vertex_colour(const TriangleMesh& mesh, const SurfacePoint& point) {
    if (mesh.colour.empty()) return glm::u8vec3(128);
    dvec3 sum(0.0);
    double weights = 0;
    for (const std::uint32_t v : mesh.face[point.face]) {
        const double weight = 1 / (1e-12 + double{glm::distance(mesh.position[v], point.position)});
        sum += weight * dvec3(mesh.colour[v]);
        weights += weight;
    }
    return glm::u8vec3(glm::round(sum / weights));
}

}  // namespace

MeshTexture unwrap_mesh(const TriangleMesh& mesh, const AtlasOptions& options) {
    DARB_CHECK(options.texel > 0 && options.page_side > 4 * options.gutter + 8, "{} {} {}",
               options.texel, options.page_side, options.gutter);
    ChartMaker maker(mesh, options);
    std::vector<Chart> charts = maker.make();
    const std::vector<glm::ivec2> pages = place_charts(options, charts);
    if (pages.size() > options.most_pages)
        throw Error("texture",
                    fmt::format("needs {} pages of {} px, and may have {}", pages.size(),
                                options.page_side, options.most_pages),
                    fmt::format("Take texels of at least {:.3g} (--texel).",
                                1.05 * options.texel *
                                    std::sqrt(static_cast<double>(pages.size()) /
                                              static_cast<double>(options.most_pages))));
    MeshTexture texture;
    texture.uv.resize(mesh.face_count());
    texture.page.resize(mesh.face_count());
    for (const glm::ivec2& page : pages) texture.image.emplace_back(page.x, page.y, 3);
    for (const Chart& chart : charts)
        for (const std::uint32_t f : chart.faces) {
            const FlatFace flat = maker.flat(f, chart.side);
            for (std::size_t c = 0; c < 3; ++c)
                texture.uv[f][c] = glm::vec2(
                    (flat.at[c] - glm::floor(chart.low) + dvec2(chart.place + options.gutter)) /
                    dvec2(pages[chart.page]));
            texture.page[f] = static_cast<std::uint32_t>(chart.page);
        }
    return texture;
}

void paint_texture(const TriangleMesh& mesh, const ColourSource& source, int gutter,
                   MeshTexture& texture) {
    Painter painter(mesh, texture);
    painter.paint([](std::uint32_t) { return true; }, source);
    painter.finish(gutter);
}

PhotoChoice choose_photos(const TriangleMesh& mesh, const PhotoViews& views, double smoothing) {
    Labelling labelling(mesh, views, smoothing / 3);
    constexpr int kMostSweeps = 20;
    for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
        const bool faces = labelling.move_faces();
        if (!labelling.move_patches() && !faces) break;
    }
    PhotoChoice choice;
    choice.unseen = static_cast<std::size_t>(
        std::count(labelling.view.begin(), labelling.view.end(), kNoPhoto));
    choice.seams = labelling.seams();
    choice.view = std::move(labelling.view);
    return choice;
}

std::optional<dvec3> photo_colour(const Camera& camera, const ImageU8& photo,
                                  const TriangleMesh& mesh, const glm::vec3& point) {
    const auto pixel = projected(camera, world_of(mesh, point));
    if (!pixel) return std::nullopt;
    return bilinear(photo, pixel->x, pixel->y);
}

void paint_with_photos(const TriangleMesh& mesh, const PhotoViews& views, const PhotoChoice& choice,
                       const SeamLevels& levels, int gutter, MeshTexture& texture) {
    Painter painter(mesh, texture);
    std::vector<bool> chosen(views.cameras.size(), false);
    for (const std::uint32_t view : choice.view)
        if (view != kNoPhoto) chosen[view] = true;
    for (std::uint32_t view = 0; view < chosen.size(); ++view) {
        if (!chosen[view]) continue;
        const ImageU8 photo = views.photo(view);
        painter.paint([&](std::uint32_t f) { return choice.view[f] == view; },
                      [&](std::span<const SurfacePoint> points, std::span<glm::u8vec3> colours) {
                          for (std::size_t i = 0; i < points.size(); ++i)
                              if (const auto colour = photo_colour(views.cameras[view], photo, mesh,
                                                                   points[i].position))
                                  colours[i] =
                                      in_levels(*colour + added_at(mesh, levels, points[i]));
                      });
    }
    painter.paint([&](std::uint32_t f) { return choice.view[f] == kNoPhoto; },
                  [&](std::span<const SurfacePoint> points, std::span<glm::u8vec3> colours) {
                      for (std::size_t i = 0; i < points.size(); ++i)
                          colours[i] = vertex_colour(mesh, points[i]);
                  });
    painter.finish(gutter);
}

}  // namespace darb
