// SPDX-License-Identifier: MIT
#include "engine/mesh/clean.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <unordered_set>
#include <utility>

#ifdef DARB_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif

#include "engine/core/error.h"
#include "engine/core/on_threads.h"
#include "engine/mesh/surface_search.h"
#include "engine/mesh/topology.h"

namespace darb {

namespace {

using Corners = std::array<std::uint32_t, 3>;

bool is_degenerate(const Corners& face) {
    return face[0] == face[1] || face[1] == face[2] || face[2] == face[0];
}

/// Removes the faces for which `gone` is true; returns how many.
template <class Gone>
std::size_t remove_faces(TriangleMesh& mesh, const Gone& gone) {
    std::size_t kept = 0;
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        if (!gone(f)) mesh.face[kept++] = mesh.face[f];
    const std::size_t removed = mesh.face_count() - kept;
    mesh.face.resize(kept);
    return removed;
}

// 1. Faces without area.

/// Height of a face over its longest edge that counts as none: a few roundings of its coordinates.
double no_height(const TriangleMesh& mesh, const Corners& face) {
    float largest = 0;
    for (const std::uint32_t v : face)
        for (int c = 0; c < 3; ++c) largest = std::max(largest, std::abs(mesh.position[v][c]));
    return 4 * double{largest} * 0x1p-24;
}

double edge_length(const TriangleMesh& mesh, std::uint32_t a, std::uint32_t b) {
    return glm::distance(glm::dvec3(mesh.position[a]), glm::dvec3(mesh.position[b]));
}

bool has_no_area(const TriangleMesh& mesh, std::size_t f) {
    const Corners& face = mesh.face[f];
    if (is_degenerate(face)) return true;
    double longest = 0;
    for (std::size_t c = 0; c < 3; ++c)
        longest = std::max(longest, edge_length(mesh, face[c], face[(c + 1) % 3]));
    return glm::length(face_cross(mesh, f)) <= no_height(mesh, face) * longest;
}

void join_coinciding_vertices(TriangleMesh& mesh) {
    UnionFind same(mesh.vertex_count());
    for (const Corners& face : mesh.face)
        for (std::size_t c = 0; c < 3; ++c) {
            const std::uint32_t a = face[c], b = face[(c + 1) % 3];
            if (a != b && edge_length(mesh, a, b) <= no_height(mesh, face)) same.join(a, b);
        }
    for (Corners& face : mesh.face)
        for (std::uint32_t& v : face) v = same.find(v);
}

/// A face whose middle vertex lies on its longest edge: that edge, with the face beyond it, is
/// turned to end in the vertex. Returns how many were turned.
std::size_t turn_caps(TriangleMesh& mesh) {
    const HalfEdgePairs pairs = pair_half_edges(mesh);
    std::vector<bool> changed(mesh.face_count(), false);
    std::size_t turned = 0;
    for (std::uint32_t f = 0; f < mesh.face_count(); ++f) {
        if (changed[f] || !has_no_area(mesh, f)) continue;
        std::uint32_t longest = 3 * f;
        const auto length = [&](std::uint32_t half) {
            return edge_length(mesh, half_edge_start(mesh, half),
                               half_edge_start(mesh, next_half_edge(half)));
        };
        for (std::uint32_t half = 3 * f + 1; half < 3 * f + 3; ++half)
            if (length(half) > length(longest)) longest = half;
        const std::uint32_t twin = pairs.twin[longest];
        if (twin == kNoHalfEdge || changed[twin / 3]) continue;
        const auto tip_of = [&](std::uint32_t half) {
            return half_edge_start(mesh, next_half_edge(next_half_edge(half)));
        };
        const std::uint32_t a = half_edge_start(mesh, longest), c = half_edge_start(mesh, twin),
                            middle = tip_of(longest), beyond = tip_of(twin);
        if (middle == beyond || has_no_area(mesh, twin / 3)) continue;
        changed[f] = changed[twin / 3] = true;
        mesh.face[f] = {a, beyond, middle};
        mesh.face[twin / 3] = {beyond, c, middle};
        ++turned;
    }
    return turned;
}

std::size_t remove_faces_without_area(TriangleMesh& mesh) {
    const std::size_t before = mesh.face_count();
    std::size_t flat = 0;
    for (std::size_t f = 0; f < before; ++f) flat += has_no_area(mesh, f);
    if (flat == 0) return 0;
    join_coinciding_vertices(mesh);
    remove_faces(mesh, [&](std::size_t f) { return is_degenerate(mesh.face[f]); });
    constexpr int kMostRounds = 8;  // caps beside caps need several
    for (int round = 0; round < kMostRounds && turn_caps(mesh) > 0; ++round) {
    }
    remove_faces(mesh, [&](std::size_t f) { return has_no_area(mesh, f); });
    return flat;
}

// 2. Parts.

/// The vertices that faces join; a part is called by the vertex that find() gives.
UnionFind parts_of(const TriangleMesh& mesh) {
    UnionFind joined(mesh.vertex_count());
    for (const Corners& face : mesh.face) {
        joined.join(face[0], face[1]);
        joined.join(face[0], face[2]);
    }
    return joined;
}

void remove_parts(TriangleMesh& mesh, const CleanOptions& options, CleanReport& report) {
    struct Part {
        std::size_t faces = 0, number = 0;
        double area = 0;
        glm::vec3 low{std::numeric_limits<float>::infinity()};
        glm::vec3 high{-std::numeric_limits<float>::infinity()};
        bool kept = true;
    };
    UnionFind joined = parts_of(mesh);
    std::map<std::uint32_t, Part> parts;
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        Part& part = parts[joined.find(mesh.face[f][0])];
        ++part.faces;
        part.area += glm::length(face_cross(mesh, f)) / 2;
        for (const std::uint32_t v : mesh.face[f]) {
            part.low = glm::min(part.low, mesh.position[v]);
            part.high = glm::max(part.high, mesh.position[v]);
        }
    }
    std::vector<Part*> by_area;
    for (auto& [vertex, part] : parts) {
        const glm::vec3 extent = part.high - part.low;
        part.kept = part.faces >= options.min_faces &&
                    std::max({extent.x, extent.y, extent.z}) >= options.min_extent;
        if (part.kept) by_area.push_back(&part);
    }
    std::stable_sort(by_area.begin(), by_area.end(),
                     [](const Part* a, const Part* b) { return a->area > b->area; });
    if (options.keep > 0)
        for (std::size_t i = options.keep; i < by_area.size(); ++i) by_area[i]->kept = false;
    report.parts = parts.size();
    for (const auto& [vertex, part] : parts) report.parts_removed += !part.kept;
    report.part_faces_removed = remove_faces(
        mesh, [&](std::size_t f) { return !parts[joined.find(mesh.face[f][0])].kept; });
}

// 3. Orientation.

void follow_normals(TriangleMesh& mesh) {
    if (mesh.normal.empty()) return;
    std::vector<glm::dvec3> sum(mesh.vertex_count(), glm::dvec3(0.0));
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        for (const std::uint32_t v : mesh.face[f]) sum[v] += face_cross(mesh, f);
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
        if (glm::dot(glm::dvec3(mesh.normal[v]), sum[v]) < 0) mesh.normal[v] = -mesh.normal[v];
}

/// Faces reached from `first` over edges of two faces, and whether each has to be turned to agree
/// with it. flipped: [F] 0 not seen, 1 as it is, 2 to be turned.
std::vector<std::uint32_t> walk_side(const TriangleMesh& mesh, const HalfEdgePairs& pairs,
                                     std::uint32_t first, std::vector<std::uint8_t>& flipped,
                                     std::size_t& disagreeing) {
    std::vector<std::uint32_t> seen{first};
    flipped[first] = 1;
    for (std::size_t i = 0; i < seen.size(); ++i)
        for (std::uint32_t half = 3 * seen[i]; half < 3 * seen[i] + 3; ++half) {
            const std::uint32_t other = pairs.neighbour[half];
            if (other == kNoHalfEdge) continue;
            const bool same_way = half_edge_start(mesh, half) == half_edge_start(mesh, other);
            const std::uint8_t own = flipped[seen[i]];
            const auto wanted = static_cast<std::uint8_t>(same_way ? 3 - own : own);
            if (flipped[other / 3] == 0) {
                flipped[other / 3] = wanted;
                seen.push_back(other / 3);
            } else if (flipped[other / 3] != wanted && half < other) {
                ++disagreeing;
            }
        }
    return seen;
}

void orient_faces(TriangleMesh& mesh, const CleanOptions& options, CleanReport& report) {
    const HalfEdgePairs pairs = pair_half_edges(mesh);
    std::vector<std::uint8_t> flipped(mesh.face_count(), 0);
    for (std::uint32_t f = 0; f < mesh.face_count(); ++f) {
        if (flipped[f] != 0) continue;
        const std::vector<std::uint32_t> side =
            walk_side(mesh, pairs, f, flipped, report.edges_not_turned);
        double vote = 0;  // for turning those that agree with the first face as they are
        for (const std::uint32_t face : side) {
            const glm::dvec3 cross = face_cross(mesh, face);
            const double area = glm::length(cross), sign = flipped[face] == 1 ? 1 : -1;
            if (!(area > 0)) continue;
            const glm::dvec3 centre = (glm::dvec3(mesh.position[mesh.face[face][0]]) +
                                       glm::dvec3(mesh.position[mesh.face[face][1]]) +
                                       glm::dvec3(mesh.position[mesh.face[face][2]])) /
                                      3.0;
            vote += area * sign *
                    (options.outside ? options.outside(glm::vec3(centre), glm::vec3(cross / area))
                                     : 1.0);
        }
        for (const std::uint32_t face : side)
            if ((flipped[face] == 2) != (vote < 0)) {
                std::swap(mesh.face[face][1], mesh.face[face][2]);
                ++report.faces_turned;
            }
    }
    if (report.faces_turned > 0) follow_normals(mesh);
}

// 4. A manifold.

std::uint32_t copy_vertex(std::uint32_t vertex, TriangleMesh& mesh) {
    const auto added = static_cast<std::uint32_t>(mesh.vertex_count());
    mesh.position.push_back(mesh.position[vertex]);
    if (!mesh.normal.empty()) mesh.normal.push_back(mesh.normal[vertex]);
    if (!mesh.colour.empty()) mesh.colour.push_back(mesh.colour[vertex]);
    return added;
}

void split_fans(TriangleMesh& mesh, const std::vector<std::uint32_t>& twin) {
    UnionFind fans = corner_fans(mesh, twin);
    std::vector<std::uint32_t> owner(mesh.vertex_count(), kNoHalfEdge);  // the fan that keeps it
    std::vector<std::uint32_t> renamed(twin.size(), kNoHalfEdge);        // by the fan's name
    for (std::uint32_t half = 0; half < twin.size(); ++half) {
        std::uint32_t& vertex = mesh.face[half / 3][half % 3];
        const std::uint32_t fan = fans.find(half);
        if (owner[vertex] == kNoHalfEdge) owner[vertex] = fan;
        if (owner[vertex] == fan) continue;
        if (renamed[fan] == kNoHalfEdge) renamed[fan] = copy_vertex(vertex, mesh);
        vertex = renamed[fan];
    }
}

/// Halves an edge for the two faces of a pair.
void halve_edge(TriangleMesh& mesh, std::uint32_t half, std::uint32_t twin) {
    const std::uint32_t a = half_edge_start(mesh, half), b = half_edge_start(mesh, twin);
    const std::uint32_t middle = copy_vertex(a, mesh);
    mesh.position[middle] = (mesh.position[a] + mesh.position[b]) / 2.0f;
    for (const std::uint32_t side : {half, twin}) {
        const std::size_t from = side % 3, to = next_half_edge(side) % 3;
        Corners second = mesh.face[side / 3];
        second[from] = middle;
        mesh.face[side / 3][to] = middle;
        mesh.face.push_back(second);
    }
}

/// Two pairs of faces may share an edge whose ends are one fan each. All but one pair get a vertex
/// of their own on it. Returns whether there were any.
bool halve_crowded_edges(TriangleMesh& mesh) {
    const HalfEdgePairs pairs = pair_half_edges(mesh);
    if (pairs.crowded_edges == 0) return false;
    std::map<std::pair<std::uint32_t, std::uint32_t>, bool> met;  // whether a pair has kept it
    std::vector<bool> touched(mesh.face_count(), false);
    bool any = false;
    for (std::uint32_t half = 0; half < pairs.twin.size(); ++half) {
        const std::uint32_t twin = pairs.twin[half];
        if (twin == kNoHalfEdge || twin < half || pairs.neighbour[half] != kNoHalfEdge) continue;
        const std::uint32_t a = half_edge_start(mesh, half), b = half_edge_start(mesh, twin);
        if (touched[half / 3] || touched[twin / 3] || half / 3 == twin / 3) continue;
        bool& kept = met[{std::min(a, b), std::max(a, b)}];
        if (kept) {
            touched[half / 3] = touched[twin / 3] = true;
            halve_edge(mesh, half, twin);
            any = true;
        }
        kept = true;
    }
    return any;
}

/// Two faces of the same three vertices that face away from each other enclose nothing.
void remove_opposite_faces(TriangleMesh& mesh) {
    struct Face {
        Corners sorted;
        std::uint32_t face;
        bool even;  // turns as the sorted vertices do
    };
    std::vector<Face> faces(mesh.face_count());
    for (std::uint32_t f = 0; f < faces.size(); ++f) {
        Corners face = mesh.face[f];
        std::rotate(face.begin(), std::min_element(face.begin(), face.end()), face.end());
        const bool even = face[1] < face[2];
        if (!even) std::swap(face[1], face[2]);
        faces[f] = {face, f, even};
    }
    std::sort(faces.begin(), faces.end(), [](const Face& x, const Face& y) {
        return x.sorted != y.sorted ? x.sorted < y.sorted : x.face < y.face;
    });
    std::vector<bool> gone(mesh.face_count(), false);
    std::vector<Face> open;  // of the same vertices, all of which turn alike
    for (const Face& face : faces) {
        if (!open.empty() && open.back().sorted != face.sorted) open.clear();
        if (!open.empty() && open.back().even != face.even) {
            gone[face.face] = gone[open.back().face] = true;
            open.pop_back();
        } else {
            open.push_back(face);
        }
    }
    remove_faces(mesh, [&](std::size_t f) { return gone[f]; });
}

/// Collapses on flat ground may leave closed parts that enclose nothing.
void remove_flat_parts(TriangleMesh& mesh) {
    struct Part {
        double volume = 0, area = 0;
        bool closed = true;
    };
    const std::vector<std::uint32_t> twin = pair_half_edges(mesh).twin;
    UnionFind joined = parts_of(mesh);
    std::map<std::uint32_t, Part> parts;
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        const std::uint32_t name = joined.find(mesh.face[f][0]);
        Part& part = parts[name];
        const glm::dvec3 cross = face_cross(mesh, f);
        part.volume += glm::dot(cross, glm::dvec3(mesh.position[mesh.face[f][0]]) -
                                           glm::dvec3(mesh.position[name])) /
                       6;
        part.area += glm::length(cross) / 2;
        for (std::size_t c = 0; c < 3; ++c) part.closed &= twin[3 * f + c] != kNoHalfEdge;
    }
    constexpr double kFlat =
        1e-3;  // of area^1.5: a ball has 0.094, a plate of 100 x 100 x 1 0.0035
    remove_faces(mesh, [&](std::size_t f) {
        const Part& part = parts[joined.find(mesh.face[f][0])];
        return part.closed && std::abs(part.volume) < kFlat * std::pow(part.area, 1.5);
    });
}

// 5. Holes.

/// The triangulation of a closed run of vertices that has the least area.
class LeastAreaFill {
  public:
    using Edges = std::unordered_set<std::uint64_t>;
    static std::uint64_t edge_key(std::uint32_t a, std::uint32_t b) {
        return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
    }

    /// edges: those of the mesh between vertices of rims, which no new face may have inside.
    LeastAreaFill(const TriangleMesh& mesh, const std::vector<std::uint32_t>& rim,
                  const Edges& edges)
        : mesh_(mesh),
          rim_(rim),
          edges_(edges),
          size_(rim.size()),
          area_(size_ * size_, 0.0),
          split_(size_ * size_, 0) {}

    /// Empty where there is none.
    std::vector<Corners> triangles() {
        constexpr double kNone = std::numeric_limits<double>::infinity();
        for (std::size_t span = 2; span < size_; ++span)
            for (std::size_t i = 0; i + span < size_; ++i) {
                const std::size_t k = i + span;
                double best = kNone;
                const bool chord = !(i == 0 && k == size_ - 1);
                if (!chord || !edges_.contains(edge_key(rim_[i], rim_[k])))
                    for (std::size_t j = i + 1; j < k; ++j) {
                        const double sum =
                            area_[i * size_ + j] + area_[j * size_ + k] + area(i, j, k);
                        if (sum >= best) continue;
                        best = sum;
                        split_[i * size_ + k] = static_cast<std::uint32_t>(j);
                    }
                area_[i * size_ + k] = best;
            }
        if (area_[size_ - 1] == kNone) return {};
        std::vector<Corners> result;
        std::vector<std::pair<std::size_t, std::size_t>> stack{{0, size_ - 1}};
        while (!stack.empty()) {
            const auto [i, k] = stack.back();
            stack.pop_back();
            if (k - i < 2) continue;
            const std::size_t j = split_[i * size_ + k];
            result.push_back({rim_[i], rim_[j], rim_[k]});
            stack.emplace_back(i, j);
            stack.emplace_back(j, k);
        }
        return result;
    }

  private:
    double area(std::size_t i, std::size_t j, std::size_t k) const {
        const glm::dvec3 a(mesh_.position[rim_[i]]);
        return glm::length(glm::cross(glm::dvec3(mesh_.position[rim_[j]]) - a,
                                      glm::dvec3(mesh_.position[rim_[k]]) - a));
    }

    const TriangleMesh& mesh_;
    const std::vector<std::uint32_t>& rim_;
    const Edges& edges_;
    std::size_t size_;
    std::vector<double> area_;  // [size][size] twice the least area between i and k
    std::vector<std::uint32_t> split_;
};

constexpr std::size_t kMostRimEdges = 1000;  // the fill takes the cube of their number: a second

bool is_fillable(const Rim& rim, const CleanOptions& options) {
    if (!(rim.length < options.longest_rim) || rim.half_edges.size() > kMostRimEdges) return false;
    // The rim of a lone face would be filled with its back.
    return rim.half_edges.size() >= 3 &&
           !std::all_of(rim.half_edges.begin(), rim.half_edges.end(),
                        [&](std::uint32_t half) { return half / 3 == rim.half_edges[0] / 3; });
}

LeastAreaFill::Edges edges_between_rims(const TriangleMesh& mesh, const std::vector<Rim>& rims,
                                        const CleanOptions& options) {
    std::vector<bool> on_rim(mesh.vertex_count(), false);
    for (const Rim& rim : rims)
        if (is_fillable(rim, options))
            for (const std::uint32_t half : rim.half_edges)
                on_rim[half_edge_start(mesh, half)] = true;
    LeastAreaFill::Edges edges;
    for (const Corners& face : mesh.face)
        for (std::size_t c = 0; c < 3; ++c)
            if (const std::uint32_t a = face[c], b = face[(c + 1) % 3]; on_rim[a] && on_rim[b])
                edges.insert(LeastAreaFill::edge_key(a, b));
    return edges;
}

void fill_holes(TriangleMesh& mesh, const CleanOptions& options, CleanReport& report) {
    const std::vector<Rim> rims = find_rims(mesh, pair_half_edges(mesh).twin);
    const LeastAreaFill::Edges edges = edges_between_rims(mesh, rims, options);
    std::vector<Corners> added;
    for (const Rim& rim : rims) {
        std::vector<Corners> fill;
        if (is_fillable(rim, options)) {
            std::vector<std::uint32_t> vertices;  // against the half-edges, as the new faces run
            for (auto half = rim.half_edges.rbegin(); half != rim.half_edges.rend(); ++half)
                vertices.push_back(half_edge_start(mesh, *half));
            fill = LeastAreaFill(mesh, vertices, edges).triangles();
        }
        if (fill.empty()) {
            ++report.holes_left;
            continue;
        }
        std::vector<std::array<glm::vec3, 3>> shown;
        for (const Corners& face : fill)
            shown.push_back(
                {mesh.position[face[0]], mesh.position[face[1]], mesh.position[face[2]]});
        if (options.may_fill && !options.may_fill(shown)) {
            ++report.holes_forbidden;
            continue;
        }
        ++report.holes_filled;
        added.insert(added.end(), fill.begin(), fill.end());
    }
    report.faces_filled = added.size();
    mesh.face.insert(mesh.face.end(), added.begin(), added.end());
}

}  // namespace

std::size_t split_into_manifold(TriangleMesh& mesh) {
    const std::size_t before = mesh.vertex_count();
    split_fans(mesh, pair_half_edges(mesh).twin);
    constexpr int kMostRounds = 16;
    for (int round = 0; round < kMostRounds && halve_crowded_edges(mesh); ++round)
        split_fans(mesh, pair_half_edges(mesh).twin);
    return mesh.vertex_count() - before;
}

CleanReport clean_mesh(TriangleMesh& mesh, const CleanOptions& options) {
    CleanReport report;
    report.faces_without_area = remove_faces_without_area(mesh);
    remove_parts(mesh, options, report);
    drop_unused_vertices(mesh);
    if (options.orient) orient_faces(mesh, options, report);
    report.vertices_split = split_into_manifold(mesh);
    fill_holes(mesh, options, report);
    return report;
}

bool can_simplify() {
#ifdef DARB_MESHOPTIMIZER
    return true;
#else
    return false;
#endif
}

#ifdef DARB_MESHOPTIMIZER
Simplified simplify_mesh(const TriangleMesh& mesh, std::size_t faces) {
    Simplified result;
    result.mesh = mesh;
    if (mesh.face_count() <= faces || mesh.face_count() == 0) return result;
    std::vector<Corners>& kept = result.mesh.face;
    float error = 0;
    const std::size_t indices =
        meshopt_simplify(kept.data()->data(), mesh.face.data()->data(), 3 * mesh.face_count(),
                         &mesh.position.data()->x, mesh.vertex_count(), sizeof(glm::vec3),
                         3 * faces, std::numeric_limits<float>::max(), 0, &error);
    kept.resize(indices / 3);
    remove_opposite_faces(result.mesh);
    split_into_manifold(result.mesh);
    if (topology_of(result.mesh).parts > topology_of(mesh).parts) remove_flat_parts(result.mesh);
    drop_unused_vertices(result.mesh);
    if (result.mesh.face_count() == 0) return result;
    const SurfaceSearch search(result.mesh);
    std::vector<double> distance(mesh.vertex_count(), 0.0);
    std::vector<bool> used(mesh.vertex_count(), false);
    for (const Corners& face : mesh.face)
        for (const std::uint32_t v : face) used[v] = true;
    in_pieces(mesh.vertex_count(), 4096, [&](std::size_t first, std::size_t count) {
        for (std::size_t v = first; v < first + count; ++v)
            if (used[v]) distance[v] = search.nearest(glm::dvec3(mesh.position[v])).distance;
    });
    result.largest_distance = *std::max_element(distance.begin(), distance.end());
    return result;
}
#else
Simplified simplify_mesh(const TriangleMesh&, std::size_t) {
    throw Error("simplify", "this darb was built without meshoptimizer",
                "Install the package libmeshoptimizer-dev, as tools/setup.sh does, and build darb "
                "again; or leave --faces out.");
}
#endif

}  // namespace darb
