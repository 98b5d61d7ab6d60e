// SPDX-License-Identifier: MIT
#include "engine/mesh/tsdf.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <numeric>
#include <thread>
#include <unordered_map>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/memory.h"
#include "engine/core/on_threads.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/pipeline.h"
#include "engine/primitives/groups.h"
#include "engine/primitives/scan.h"

namespace darb {

namespace {

constexpr int kAxisBits = 21;  // of a Morton key
constexpr std::int64_t kAxisHalf = 1 << (kAxisBits - 1);
constexpr double kLargestPixel = 8;  // voxels
constexpr double kFarthestMedians = 4;
// What a block of the surface leaves on the host in the usual case: vertices, their names, faces.
constexpr double kHostBytesOfBlock = 40e3;

std::uint64_t spread_bits(std::uint64_t x) {  // two zeros behind each of 21 bits
    x = (x | x << 32) & 0x1F00000000FFFFull;
    x = (x | x << 16) & 0x1F0000FF0000FFull;
    x = (x | x << 8) & 0x100F00F00F00F00Full;
    x = (x | x << 4) & 0x10C30C30C30C30C3ull;
    return (x | x << 2) & 0x1249249249249249ull;
}

std::uint64_t gathered_bits(std::uint64_t x) {
    x &= 0x1249249249249249ull;
    x = (x | x >> 2) & 0x10C30C30C30C30C3ull;
    x = (x | x >> 4) & 0x100F00F00F00F00Full;
    x = (x | x >> 8) & 0x1F0000FF0000FFull;
    x = (x | x >> 16) & 0x1F00000000FFFFull;
    return (x | x >> 32) & 0x1FFFFFull;
}

std::uint64_t morton_of(const BlockPlace& place) {
    std::uint64_t key = 0;
    for (unsigned a = 0; a < 3; ++a)
        key |= spread_bits(static_cast<std::uint64_t>(place[a] + kAxisHalf)) << a;
    return key;
}

BlockPlace place_of(std::uint64_t key) {
    BlockPlace place;
    for (unsigned a = 0; a < 3; ++a)
        place[a] = static_cast<std::int32_t>(static_cast<std::int64_t>(gathered_bits(key >> a)) -
                                             kAxisHalf);
    return place;
}

/// Keys in a table that grows; few are new, so that most calls end at the first look.
class KeySet {
  public:
    void add(std::uint64_t key) {
        if (key == last_) return;
        last_ = key;
        if (2 * (count_ + 1) > slots_.size()) grow();
        put(key);
    }
    void append_to(std::vector<std::uint64_t>& keys) const {
        for (const std::uint64_t key : slots_)
            if (key != kEmpty) keys.push_back(key);
    }

  private:
    static constexpr std::uint64_t kEmpty = ~std::uint64_t{0};
    void put(std::uint64_t key) {
        const std::size_t mask = slots_.size() - 1;
        std::size_t at = (key * 0x9E3779B97F4A7C15ull >> 32) & mask;
        while (slots_[at] != kEmpty && slots_[at] != key) at = (at + 1) & mask;
        if (slots_[at] == kEmpty) ++count_;
        slots_[at] = key;
    }
    void grow() {
        std::vector<std::uint64_t> old =
            std::exchange(slots_, std::vector<std::uint64_t>(2 * slots_.size(), kEmpty));
        count_ = 0;
        for (const std::uint64_t key : old)
            if (key != kEmpty) put(key);
    }
    std::vector<std::uint64_t> slots_ = std::vector<std::uint64_t>(1024, kEmpty);
    std::size_t count_ = 0;
    std::uint64_t last_ = kEmpty;
};

// The blocks that a segment meets, in the order in which it meets them. Coordinates in sides of a
// block.
void add_segment(const glm::dvec3& from, const glm::dvec3& to, KeySet& keys) {
    BlockPlace place, last;
    glm::dvec3 next, step;
    const glm::dvec3 along = to - from;
    for (int a = 0; a < 3; ++a) {
        place[a] = static_cast<std::int32_t>(std::floor(from[a]));
        last[a] = static_cast<std::int32_t>(std::floor(to[a]));
        step[a] = along[a] != 0 ? 1 / std::abs(along[a]) : std::numeric_limits<double>::infinity();
        const double rest = along[a] > 0 ? place[a] + 1 - from[a] : from[a] - place[a];
        next[a] = along[a] != 0 ? rest * step[a] : std::numeric_limits<double>::infinity();
    }
    keys.add(morton_of(place));
    int left = 0;
    for (int a = 0; a < 3; ++a) left += std::abs(last[a] - place[a]);
    for (; left > 0; --left) {
        int axis = -1;
        for (int a = 0; a < 3; ++a)
            if (place[a] != last[a] && (axis < 0 || next[a] < next[axis])) axis = a;
        place[axis] += along[axis] > 0 ? 1 : -1;
        next[axis] += step[axis];
        keys.add(morton_of(place));
    }
}

bool holds(const WorldBox& box, const glm::dvec3& p) {
    return glm::all(glm::greaterThanEqual(p, box.low)) && glm::all(glm::lessThanEqual(p, box.high));
}

void add_blocks_of_view(const DepthView& view, const TsdfOptions& options, const glm::dvec3& origin,
                        KeySet& keys) {
    const Camera& c = view.camera;
    const glm::dmat3 to_world = glm::transpose(c.rotation);
    const glm::dvec3 centre = c.centre() - origin;
    const double side = options.voxel * BLOCK_SIDE, band = options.voxel * options.truncation;
    const double least_focal = std::min(c.fx, c.fy);
    for (int y = 0; y < c.height; ++y)
        for (int x = 0; x < c.width; ++x) {
            const double z = view.depth[std::size_t(y) * c.width + x];
            if (!(z > 0) || z > options.farthest || z > kLargestPixel * options.voxel * least_focal)
                continue;
            const glm::dvec3 ray =
                to_world * glm::dvec3((x + 0.5 - c.cx) / c.fx, (y + 0.5 - c.cy) / c.fy, 1);
            if (options.bounds && !holds(*options.bounds, centre + ray * z)) continue;
            add_segment((centre + ray * (z - band)) / side, (centre + ray * (z + band)) / side,
                        keys);
        }
}

// As the passes place it: in float, so that both say the same of a point.
glm::vec3 voxel_place(const glm::ivec3& first, std::size_t within, double voxel) {
    const auto side = static_cast<std::size_t>(BLOCK_SIDE);
    const glm::ivec3 in_block(within % side, within / side % side, within / (side * side));
    return glm::vec3(first + in_block) * static_cast<float>(voxel);
}

/// Blocks of a range, which come first, and those around it that its cubes have corners in.
struct BlockRange {
    std::uint32_t own = 0;
    std::vector<std::uint32_t> blocks;      // [B] index in the list of all
    std::vector<glm::ivec3> places;         // [B]
    std::vector<std::uint32_t> neighbours;  // [B][8] of the range
};

class BlockIndex {
  public:
    explicit BlockIndex(const std::vector<BlockPlace>& places) : places_(places) {
        keys_.reserve(places.size());
        for (const BlockPlace& place : places) keys_.push_back(morton_of(place));
    }
    /// NO_BLOCK where there is none.
    std::uint32_t find(const BlockPlace& place) const {
        const std::uint64_t key = morton_of(place);
        const auto at = std::ranges::lower_bound(keys_, key);
        return at != keys_.end() && *at == key ? static_cast<std::uint32_t>(at - keys_.begin())
                                               : NO_BLOCK;
    }
    std::uint32_t beside(std::uint32_t block, unsigned bits) const {
        BlockPlace place = places_[block];
        for (unsigned a = 0; a < 3; ++a) place[a] += static_cast<std::int32_t>(bits >> a & 1);
        return find(place);
    }
    BlockRange range(std::uint32_t first, std::uint32_t own) const;
    std::size_t size() const { return places_.size(); }

  private:
    const std::vector<BlockPlace>& places_;
    std::vector<std::uint64_t> keys_;
};

BlockRange BlockIndex::range(std::uint32_t first, std::uint32_t own) const {
    BlockRange range;
    range.own = own;
    std::vector<std::uint32_t> shell;
    for (std::uint32_t b = first; b < first + own; ++b) {
        range.blocks.push_back(b);
        for (unsigned bits = 1; bits < 8; ++bits) {
            const std::uint32_t other = beside(b, bits);
            if (other != NO_BLOCK && (other < first || other >= first + own))
                shell.push_back(other);
        }
    }
    std::ranges::sort(shell);
    shell.erase(std::unique(shell.begin(), shell.end()), shell.end());
    range.blocks.insert(range.blocks.end(), shell.begin(), shell.end());
    std::unordered_map<std::uint32_t, std::uint32_t> place_in_range;
    for (std::uint32_t i = 0; i < range.blocks.size(); ++i) place_in_range[range.blocks[i]] = i;
    for (const std::uint32_t b : range.blocks) {
        range.places.emplace_back(places_[b][0], places_[b][1], places_[b][2]);
        for (unsigned bits = 0; bits < 8; ++bits) {
            const auto at = place_in_range.find(bits == 0 ? b : beside(b, bits));
            range.neighbours.push_back(at == place_in_range.end() ? NO_BLOCK : at->second);
        }
    }
    return range;
}

/// Vertices by the edge they are on, and faces between them; of all ranges so far.
struct RawSurface {
    std::vector<glm::vec3> vertices;
    std::vector<std::uint64_t> names;  // block of the list of all, voxel, edge
    std::vector<std::array<std::uint32_t, 3>> faces;
};

// Device memory of a block of a range: distances, cut edges, two counts, place, neighbours, and
// what a surface through it leaves.
constexpr std::uint64_t kBytesBesideOutput = BLOCK_VOXELS * (8 + 3 * 4) + 12 + 32;
constexpr std::uint64_t kOutputBytes = 24'000;

class RangeFusion {
  public:
    RangeFusion(Device& device, const std::vector<DepthView>& views, const glm::dvec3& origin,
                const TsdfOptions& options, const SurfaceField* field);
    /// Blocks that a range with its shell may have.
    std::uint32_t capacity() const { return capacity_; }
    /// False where the surface of the range is more than the buffers hold.
    bool add(const BlockRange& range, RawSurface& to);

  private:
    void integrate(std::uint32_t blocks);
    void ask_field(const BlockRange& range);
    gpu::SurfaceArgs count(const BlockRange& range, std::array<std::uint32_t, 2>& totals);
    bool emit(const BlockRange& range, const gpu::SurfaceArgs& args,
              const std::array<std::uint32_t, 2>& totals, RawSurface& to);

    Device* device_;
    TsdfOptions options_;
    const SurfaceField* field_;
    std::size_t view_count_;
    ViewBatch batch_;
    std::uint32_t capacity_;
    Pipeline integrate_, count_, emit_;
    Commands commands_;
    Scan scan_;
    Buffer places_, neighbours_, sums_, edges_, vertex_at_, face_at_, voxels_, totals_;
};

std::uint64_t batch_pixels(const TsdfOptions& options, const Device& device) {
    return std::min(options.working_bytes / 4, device.info().max_storage_buffer_bytes) /
           sizeof(float);
}

std::uint32_t capacity_for(const TsdfOptions& options, const Device& device) {
    const std::uint64_t by_memory =
        options.working_bytes * 3 / 4 / (kBytesBesideOutput + kOutputBytes);
    const std::uint64_t by_binding =
        device.info().max_storage_buffer_bytes / (BLOCK_VOXELS * sizeof(glm::vec2));
    const std::uint64_t by_name = (std::uint64_t{1} << 32) / (BLOCK_VOXELS * 8) - 1;
    return static_cast<std::uint32_t>(
        std::max<std::uint64_t>(std::min({by_memory, by_binding, by_name}), 8));
}

RangeFusion::RangeFusion(Device& device, const std::vector<DepthView>& views,
                         const glm::dvec3& origin, const TsdfOptions& options,
                         const SurfaceField* field)
    : device_(&device),
      options_(options),
      field_(field),
      view_count_(views.size()),
      batch_(device, views, origin, batch_pixels(options, device), false),
      capacity_(capacity_for(options, device)),
      commands_(device),
      scan_(device, capacity_ * BLOCK_VOXELS) {
    const SpecConstants threads{{"THREADS", static_cast<std::int32_t>(MESH_GROUP)}};
    integrate_ = Pipeline(device, "integrate", threads);
    count_ = Pipeline(device, "surface_count", threads);
    emit_ = Pipeline(device, "surface_emit", threads);
    const auto make = [&](const char* name, std::uint64_t bytes_of_block) {
        return Buffer(device, name, capacity_ * bytes_of_block, Memory::device, "mesh");
    };
    places_ = make("block places", sizeof(glm::ivec3));
    neighbours_ = make("block neighbours", 8 * sizeof(std::uint32_t));
    sums_ = make("signed distances", BLOCK_VOXELS * sizeof(glm::vec2));
    edges_ = make("cut edges", BLOCK_VOXELS * sizeof(std::uint32_t));
    vertex_at_ = make("vertices of voxels", BLOCK_VOXELS * sizeof(std::uint32_t));
    face_at_ = make("faces of voxels", BLOCK_VOXELS * sizeof(std::uint32_t));
    voxels_ = Buffer(device, "voxel count", sizeof(std::uint32_t));
    totals_ = Buffer(device, "surface totals", 2 * 256);  // a binding begins at such multiples
}

void RangeFusion::integrate(std::uint32_t blocks) {
    commands_.begin();
    commands_.fill(sums_, 0);
    commands_.submit_and_wait();
    const Groups g = groups_for(blocks, 1);
    for (std::size_t first = 0; first < view_count_;) {
        const std::size_t end = batch_.load(first);
        commands_.begin();
        commands_.pass("integrate");
        const gpu::IntegrateArgs args{blocks, static_cast<std::uint32_t>(end - first),
                                      static_cast<float>(options_.voxel),
                                      static_cast<float>(options_.voxel * options_.truncation),
                                      static_cast<float>(options_.farthest)};
        commands_.dispatch(integrate_, args, {batch_.views(), batch_.depths(), places_, sums_}, g.x,
                           g.y);
        commands_.submit_and_wait();
        first = end;
    }
}

// The distances say which voxels are near a surface that a view sees: the others keep no value.
void RangeFusion::ask_field(const BlockRange& range) {
    constexpr float kFree = 0.9999f;  // of the band, in the mean: some view is within it
    auto sums = sums_.download<glm::vec2>(range.blocks.size() * BLOCK_VOXELS);
    std::vector<glm::vec3> points;
    std::vector<std::size_t> which;
    for (std::size_t i = 0; i < sums.size(); ++i) {
        const bool is_near = sums[i].y > 0 && sums[i].x < kFree * sums[i].y;
        sums[i] = glm::vec2(0.0f);
        if (!is_near) continue;
        const glm::ivec3 place = range.places[i / BLOCK_VOXELS] * int(BLOCK_SIDE);
        points.push_back(voxel_place(place, i % BLOCK_VOXELS, options_.voxel));
        which.push_back(i);
    }
    const std::vector<float> values = field_->at_voxels(points);
    for (std::size_t k = 0; k < which.size(); ++k)
        if (!std::isnan(values[k])) sums[which[k]] = {values[k], 1.0f};
    sums_.upload(sums);
}

gpu::SurfaceArgs RangeFusion::count(const BlockRange& range, std::array<std::uint32_t, 2>& totals) {
    const auto blocks = static_cast<std::uint32_t>(range.blocks.size());
    const gpu::SurfaceArgs args{blocks, range.own, static_cast<float>(options_.voxel)};
    const Groups g = groups_for(std::uint64_t{blocks} * BLOCK_VOXELS, MESH_GROUP);
    commands_.begin();
    commands_.pass("surface count");
    commands_.fill(voxels_, blocks * BLOCK_VOXELS);
    commands_.dispatch(count_, args, {sums_, neighbours_, edges_, vertex_at_, face_at_}, g.x, g.y);
    scan_.record(commands_, vertex_at_, vertex_at_, voxels_, 0, BufferRange(totals_, 0, 4));
    scan_.record(commands_, face_at_, face_at_, voxels_, 0, BufferRange(totals_, 256, 4));
    commands_.submit_and_wait();
    totals = {totals_.download<std::uint32_t>(1)[0], totals_.download<std::uint32_t>(1, 256)[0]};
    return args;
}

bool RangeFusion::emit(const BlockRange& range, const gpu::SurfaceArgs& args,
                       const std::array<std::uint32_t, 2>& totals, RawSurface& to) {
    const auto [vertex_total, face_total] = totals;
    if (face_total == 0) return true;
    const std::uint64_t most = device_->info().max_storage_buffer_bytes;
    const std::uint64_t bytes = std::uint64_t{vertex_total} * 16 + std::uint64_t{face_total} * 12;
    if (range.own > 1 && (vertex_total * 12ull > most || face_total * 12ull > most ||
                          bytes > std::uint64_t{capacity_} * kOutputBytes))
        return false;
    const Buffer vertices(*device_, "vertices", vertex_total * sizeof(glm::vec3));
    const Buffer names(*device_, "vertex names", vertex_total * sizeof(std::uint32_t));
    const Buffer faces(*device_, "faces", face_total * 3ull * sizeof(std::uint32_t));
    const Groups g = groups_for(std::uint64_t{args.blocks} * BLOCK_VOXELS, MESH_GROUP);
    commands_.begin();
    commands_.pass("surface emit");
    commands_.dispatch(
        emit_, args,
        {sums_, neighbours_, edges_, vertex_at_, face_at_, places_, vertices, names, faces}, g.x,
        g.y);
    commands_.submit_and_wait();
    const auto base = static_cast<std::uint32_t>(to.vertices.size());
    const auto points = vertices.download<glm::vec3>(vertex_total);
    to.vertices.insert(to.vertices.end(), points.begin(), points.end());
    for (const std::uint32_t name : names.download<std::uint32_t>(vertex_total))
        to.names.push_back(std::uint64_t{range.blocks[name / (8 * BLOCK_VOXELS)]} *
                               (8 * BLOCK_VOXELS) +
                           name % (8 * BLOCK_VOXELS));
    for (auto face : faces.download<std::array<std::uint32_t, 3>>(face_total)) {
        for (std::uint32_t& corner : face) corner += base;
        to.faces.push_back(face);
    }
    return true;
}

bool RangeFusion::add(const BlockRange& range, RawSurface& to) {
    places_.upload(range.places);
    neighbours_.upload(range.neighbours);
    integrate(static_cast<std::uint32_t>(range.blocks.size()));
    if (field_ != nullptr) ask_field(range);
    std::array<std::uint32_t, 2> totals{};
    const gpu::SurfaceArgs args = count(range, totals);
    return emit(range, args, totals, to);
}

// The largest range from `first` on that fits with its shell; at least a block.
BlockRange fitting_range(const BlockIndex& index, std::uint32_t first, std::uint32_t most,
                         std::uint32_t capacity) {
    auto own =
        static_cast<std::uint32_t>(std::min<std::size_t>({index.size() - first, most, capacity}));
    for (;;) {
        BlockRange range = index.range(first, own);
        if (range.blocks.size() <= capacity || own == 1) return range;
        own = std::max(1u, own * 3 / 4);
    }
}

// Vertices that faces use, once each, in the order of their edges' names, which it returns.
std::vector<std::uint64_t> join(RawSurface& raw, TriangleMesh& mesh) {
    std::vector<std::uint64_t> names;
    std::vector<std::uint32_t> order(raw.vertices.size());
    std::iota(order.begin(), order.end(), 0u);
    std::vector<bool> used(raw.vertices.size());
    for (const auto& face : raw.faces)
        for (const std::uint32_t corner : face) used[corner] = true;
    std::erase_if(order, [&](std::uint32_t v) { return !used[v]; });
    std::ranges::stable_sort(order, {}, [&](std::uint32_t v) { return raw.names[v]; });
    std::vector<std::uint32_t> place(raw.vertices.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        if (i == 0 || raw.names[order[i]] != raw.names[order[i - 1]]) {
            mesh.position.push_back(raw.vertices[order[i]]);
            names.push_back(raw.names[order[i]]);
        }
        place[order[i]] = static_cast<std::uint32_t>(mesh.position.size() - 1);
    }
    mesh.face = std::move(raw.faces);
    for (auto& face : mesh.face)
        for (std::uint32_t& corner : face) corner = place[corner];
    return names;
}

std::vector<VoxelEdge> edges_named(const std::vector<std::uint64_t>& names,
                                   const std::vector<BlockPlace>& places, double voxel) {
    std::vector<VoxelEdge> edges;
    edges.reserve(names.size());
    for (const std::uint64_t name : names) {
        const BlockPlace& block = places[name / (8 * BLOCK_VOXELS)];
        const glm::ivec3 first = glm::ivec3(block[0], block[1], block[2]) * int(BLOCK_SIDE);
        const auto within = static_cast<std::size_t>(name / 8 % BLOCK_VOXELS);
        const auto d = static_cast<int>(name % 8);
        const glm::ivec3 along(d & 1, d >> 1 & 1, d >> 2);
        edges.push_back(
            {voxel_place(first, within, voxel), voxel_place(first + along, within, voxel)});
    }
    return edges;
}

void cut_to(const WorldBox& box, TriangleMesh& mesh) {
    std::vector<bool> inside;
    for (const glm::vec3& p : mesh.position) inside.push_back(holds(box, glm::dvec3(p)));
    std::erase_if(mesh.face, [&](const auto& face) {
        return !(inside[face[0]] && inside[face[1]] && inside[face[2]]);
    });
}

void check_host_memory(std::size_t blocks, double voxel) {
    const double needed = double(blocks) * kHostBytesOfBlock, there = double(free_memory());
    if (needed < 0.8 * there) return;
    // Blocks of a surface grow with the square of 1 / voxel.
    const double larger = voxel * std::sqrt(needed / (0.4 * there));
    throw NoRoom("mesh",
                 fmt::format("a voxel of {:.3g} needs {:.1f} GB, {:.1f} GB are free", voxel,
                             needed / 1e9, there / 1e9),
                 fmt::format("Use --voxel {:.2g}, which needs {:.1f} GB, or less of the scene "
                             "(--bounds, --far).",
                             larger, 0.4 * there / 1e9));
}

}  // namespace

std::vector<BlockPlace> blocks_of_surface(const std::vector<DepthView>& views,
                                          const TsdfOptions& options, const glm::dvec3& origin) {
    std::vector<std::uint64_t> keys;
    std::mutex guard;
    std::atomic<std::size_t> next{0};
    const std::size_t threads = std::max(1u, std::thread::hardware_concurrency());
    on_threads(std::min(threads, views.size()), [&] {
        KeySet own;
        for (std::size_t v = 0; (v = next.fetch_add(1)) < views.size();)
            add_blocks_of_view(views[v], options, origin, own);
        const std::scoped_lock lock(guard);
        own.append_to(keys);
    });
    std::ranges::sort(keys);
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
    std::vector<BlockPlace> places;
    places.reserve(keys.size());
    for (const std::uint64_t key : keys) places.push_back(place_of(key));
    return places;
}

TsdfOptions with_defaults(TsdfOptions options, const std::vector<DepthView>& views) {
    std::vector<float> depths, pixels;
    for (const DepthView& view : views)
        for (const float z : view.depth) {
            if (!(z > 0)) continue;
            depths.push_back(z);
            pixels.push_back(z / static_cast<float>(std::min(view.camera.fx, view.camera.fy)));
        }
    if (depths.empty())
        throw Error("mesh", fmt::format("no surface is seen by two of the {} views", views.size()),
                    "Use cameras that look at the scene from nearby places (--cameras), or a "
                    "higher --level where its splats are transparent.");
    const auto middle = [](std::vector<float>& values) {
        const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
        std::nth_element(values.begin(), at, values.end());
        return double(*at);
    };
    if (options.voxel == 0) options.voxel = middle(pixels);
    if (options.farthest == 0) options.farthest = kFarthestMedians * middle(depths);
    return options;
}

TriangleMesh fuse_depths(Device& device, const std::vector<DepthView>& views,
                         const glm::dvec3& origin, const TsdfOptions& asked, TsdfReport& report,
                         const MeshProgress& progress, const SurfaceField* field) {
    const TsdfOptions options = with_defaults(asked, views);
    const std::vector<BlockPlace> places = blocks_of_surface(views, options, origin);
    report = {options.voxel, options.farthest, places.size(), 0};
    if (places.empty())
        throw Error("mesh", "no surface lies within the bounds and the largest depth",
                    "Widen --bounds or --far, or leave them out.");
    check_host_memory(places.size(), options.voxel);
    const BlockIndex index(places);
    RawSurface raw;
    {
        RangeFusion fusion(device, views, origin, options, field);
        std::uint32_t most = fusion.capacity();
        for (std::uint32_t first = 0; first < places.size();) {
            if (progress) progress("surface", double(first) / double(places.size()));
            const BlockRange range = fitting_range(index, first, most, fusion.capacity());
            if (!fusion.add(range, raw)) {
                most = std::max(1u, range.own / 2);
                continue;
            }
            first += range.own;
            ++report.ranges;
        }
    }
    TriangleMesh mesh;
    mesh.origin = {origin.x, origin.y, origin.z};
    const std::vector<std::uint64_t> names = join(raw, mesh);
    if (field != nullptr) field->on_edges(edges_named(names, places, options.voxel), mesh.position);
    if (options.bounds) cut_to(*options.bounds, mesh);
    set_normals(mesh);
    return mesh;
}

void set_normals(TriangleMesh& mesh) {
    std::vector<glm::dvec3> sums(mesh.vertex_count(), glm::dvec3(0.0));
    for (const auto& face : mesh.face) {
        const glm::dvec3 a(mesh.position[face[0]]), b(mesh.position[face[1]]),
            c(mesh.position[face[2]]);
        const glm::dvec3 normal = glm::cross(b - a, c - a);
        for (const std::uint32_t corner : face) sums[corner] += normal;
    }
    mesh.normal.resize(sums.size());
    for (std::size_t v = 0; v < sums.size(); ++v) {
        const double length = glm::length(sums[v]);
        mesh.normal[v] = length > 0 ? glm::vec3(sums[v] / length) : glm::vec3(0, 0, 1);
    }
}

std::vector<glm::u8vec3> colours_at(Device& device, const std::vector<DepthView>& views,
                                    const glm::dvec3& origin, const std::vector<glm::vec3>& points,
                                    double voxel, std::uint64_t working_bytes,
                                    const MeshProgress& progress) {
    constexpr std::uint64_t kPointBytes = sizeof(glm::vec3) + sizeof(glm::vec4);
    const std::uint64_t binding = device.info().max_storage_buffer_bytes;
    const std::uint64_t chunk = std::max<std::uint64_t>(
        std::min({working_bytes / 2 / kPointBytes, binding / sizeof(glm::vec4),
                  std::uint64_t{points.size()}}),
        1);
    ViewBatch batch(device, views, origin, std::min(working_bytes / 2, binding) / 8, true);
    const Pipeline bake(device, "bake", {{"THREADS", static_cast<std::int32_t>(MESH_GROUP)}});
    Buffer vertices(device, "vertices", chunk * sizeof(glm::vec3), Memory::device, "bake");
    const Buffer sums(device, "colour sums", chunk * sizeof(glm::vec4), Memory::device, "bake");
    Commands commands(device);
    std::vector<glm::u8vec3> colours;
    for (std::size_t first = 0; first < points.size(); first += chunk) {
        const std::size_t count = std::min<std::size_t>(chunk, points.size() - first);
        const auto from = points.begin() + static_cast<std::ptrdiff_t>(first);
        vertices.upload(std::vector(from, from + static_cast<std::ptrdiff_t>(count)));
        commands.begin();
        commands.fill(sums, 0);
        commands.submit_and_wait();
        for (std::size_t v = 0; v < views.size();) {
            if (progress) progress("colours", double(v) / double(views.size()));
            const std::size_t end = batch.load(v);
            const Groups g = groups_for(count, MESH_GROUP);
            commands.begin();
            commands.pass("bake");
            commands.dispatch(
                bake,
                gpu::BakeArgs{static_cast<std::uint32_t>(count),
                              static_cast<std::uint32_t>(end - v), static_cast<float>(2 * voxel)},
                {batch.views(), batch.depths(), batch.colours(), vertices, sums}, g.x, g.y);
            commands.submit_and_wait();
            v = end;
        }
        for (const glm::vec4& sum : sums.download<glm::vec4>(count)) {
            const glm::vec3 mean = sum.w > 0 ? glm::vec3(sum) / sum.w : glm::vec3(0.5f);
            colours.emplace_back(glm::clamp(mean, 0.0f, 1.0f) * 255.0f + 0.5f);
        }
    }
    return colours;
}

void bake_colours(Device& device, const std::vector<DepthView>& views, TriangleMesh& mesh,
                  double voxel, std::uint64_t working_bytes, const MeshProgress& progress) {
    const glm::dvec3 origin(mesh.origin[0], mesh.origin[1], mesh.origin[2]);
    mesh.colour = colours_at(device, views, origin, mesh.position, voxel, working_bytes, progress);
}

}  // namespace darb
