// SPDX-License-Identifier: MIT
// The small passes between projection and blending, each alone against the host: compact,
// gather_counts, frame_groups, emit and emit_slots, tile_ranges and tile_order.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "engine/core/rng.h"
#include "engine/reference/reference_render.h"
#include "tests/support/projected_frame.h"
#include "tests/support/test_scene.h"

namespace darb::test {
namespace {

using Words = std::vector<std::uint32_t>;

void run(const char* shader, const auto& args, std::initializer_list<BufferRange> buffers,
         std::uint32_t items, SpecConstants constants = {}, bool one_thread = false) {
    constants["THREADS"] = one_thread ? 1 : SPLAT_GROUP;
    const Pipeline pipeline(shared_device(), shader, constants, !one_thread);
    Commands commands(shared_device());
    commands.begin();
    const Groups g = one_thread ? Groups{} : groups_for(items);
    commands.dispatch(pipeline, args, buffers, g.x, g.y);
    commands.submit_and_wait();
}

TEST(Compact, visible_splats_keep_their_order) {
    Device& device = shared_device();
    for (const std::uint32_t n : {1U, 63U, 64U, 65U, 1000U}) {
        Pcg32 rng(n);
        Words visible(n), offset(n), keys, order;
        std::vector<glm::vec4> bound(n);
        for (std::uint32_t i = 0; i < n; ++i) {
            visible[i] = rng.below(3) > 0 ? 1 : 0;
            offset[i] = static_cast<std::uint32_t>(order.size());
            bound[i] = glm::vec4(0, 0, static_cast<float>(rng.uniform(0.2, 100)), 0);
            if (visible[i] == 0) continue;
            order.push_back(i);
            keys.push_back(std::bit_cast<std::uint32_t>(bound[i].z));
        }
        const GuardedBuffer flags(device, "visible", visible), offsets(device, "offset", offset),
            bounds(device, "bound", bound), key(device, "key", keys.size() * 4),
            splat(device, "order", order.size() * 4),
            status(device, "status", std::vector<gpu::FrameStatus>(1));
        run("compact", gpu::CompactArgs{n, 0.2f}, {flags, offsets, bounds, key, splat, status}, n);
        EXPECT_EQ(key.read<std::uint32_t>(), keys) << n;
        EXPECT_EQ(splat.read<std::uint32_t>(), order) << n;
        EXPECT_TRUE(key.intact() && splat.intact()) << n;
    }
}

// Keys of 27 bits: the same order, and a flag where a depth is 65,536 times the near plane's.
TEST(Compact, short_keys_keep_the_order_and_tell_of_depths_beyond_them) {
    Device& device = shared_device();
    const float reach = 0.2f * 65'536;
    std::vector<glm::vec4> bound;
    for (const float z :
         {std::nextafter(0.2f, 1.0f), 0.3f, 1.0f, 7.0f, std::nextafter(reach, 0.0f)})
        bound.emplace_back(0, 0, z, 0);
    for (const bool deep : {false, true}) {
        if (deep) bound.emplace_back(0, 0, reach, 0);
        const auto n = static_cast<std::uint32_t>(bound.size());
        Words offset(n);
        std::iota(offset.begin(), offset.end(), 0U);
        const GuardedBuffer flags(device, "visible", Words(n, 1)),
            offsets(device, "offset", offset), bounds(device, "bound", bound),
            key(device, "keys", n * 4), splat(device, "order", n * 4),
            status(device, "status", std::vector<gpu::FrameStatus>(1));
        run("compact", gpu::CompactArgs{n, 0.2f}, {flags, offsets, bounds, key, splat, status}, n,
            {{"SHORT_KEYS", 1}});
        const Words keys = key.read<std::uint32_t>();
        EXPECT_TRUE(std::is_sorted(keys.begin(), keys.end()));
        EXPECT_EQ(keys[0], 1U);
        EXPECT_EQ(keys[4], (1U << SHORT_DEPTH_BITS) - 1);
        EXPECT_EQ(status.read<gpu::FrameStatus>()[0].overflow, deep ? OVERFLOW_DEPTHS : 0U);
    }
}

TEST(GatherCounts, counts_come_in_depth_order) {
    Device& device = shared_device();
    const Words order = {4, 1, 0, 7}, counts = {10, 11, 12, 13, 14, 15, 16, 17};
    std::vector<gpu::FrameStatus> status(1);
    status[0].visible = 4;
    const GuardedBuffer s(device, "status", status), o(device, "order", order),
        c(device, "counts", counts), sorted(device, "sorted", 4 * 4);
    run("gather_counts", gpu::SplatArgs{8}, {s, o, c, sorted}, 64);
    EXPECT_EQ(sorted.read<std::uint32_t>(), (Words{14, 11, 10, 17}));
    EXPECT_TRUE(sorted.intact());
}

struct GroupsOutcome {
    gpu::FrameStatus status;
    gpu::FrameGroups groups;
    std::uint32_t in_use;
};
GroupsOutcome frame_groups(int stage, std::uint32_t total, std::uint32_t capacity,
                           std::uint32_t overflow_before = 0) {
    Device& device = shared_device();
    std::vector<gpu::FrameStatus> before(1);
    before[0].overflow = overflow_before;
    const GuardedBuffer status(device, "status", before),
        groups(device, "groups", sizeof(gpu::FrameGroups)), sum(device, "total", Words{total}),
        in_use(device, "in use", 4);
    run("frame_groups", gpu::IntersectionArgs{capacity, 1, 1, 0}, {status, groups, sum, in_use}, 1,
        {{"STAGE", stage}}, true);
    EXPECT_TRUE(status.intact() && groups.intact() && in_use.intact());
    return {status.read<gpu::FrameStatus>()[0], groups.read<gpu::FrameGroups>()[0],
            in_use.read<std::uint32_t>()[0]};
}

void expect_groups_hold(std::uint32_t x, std::uint32_t y, std::uint32_t z, std::uint64_t count) {
    EXPECT_GE(std::uint64_t(x) * y * SPLAT_GROUP, count);
    EXPECT_LE(std::uint64_t(x) * y, count / SPLAT_GROUP + 1 + y) << "idle groups";
    EXPECT_TRUE(x >= 1 && x <= MAX_GROUPS && y >= 1 && y <= MAX_GROUPS && z == 1) << x << " " << y;
}

TEST(FrameGroups, dispatches_hold_every_count) {
    for (const std::uint32_t n : {0U, 1U, 64U, 65U, 4'194'240U, 4'194'241U, 9'000'000U, 1U << 30}) {
        SCOPED_TRACE(n);
        const GroupsOutcome visible = frame_groups(0, n, 0);
        EXPECT_EQ(visible.status.visible, n);
        EXPECT_EQ(visible.in_use, n);
        expect_groups_hold(visible.groups.visible_x, visible.groups.visible_y,
                           visible.groups.visible_z, n);
        const GroupsOutcome intersections = frame_groups(1, n, n);
        EXPECT_EQ(intersections.status.intersections, n);
        EXPECT_EQ(intersections.status.overflow, 0U);
        expect_groups_hold(intersections.groups.intersections_x,
                           intersections.groups.intersections_y,
                           intersections.groups.intersections_z, n);
    }
}

TEST(FrameGroups, more_intersections_than_room_raise_the_flag_and_are_cut) {
    for (const std::uint32_t total : {1001U, 5000U, 0xffffffffU}) {
        const GroupsOutcome o = frame_groups(1, total, 1000);
        EXPECT_EQ(o.status.overflow, 1U);
        EXPECT_EQ(o.status.intersections, total);
        EXPECT_EQ(o.in_use, 1000U);
        expect_groups_hold(o.groups.intersections_x, o.groups.intersections_y,
                           o.groups.intersections_z, 1000);
    }
    EXPECT_EQ(frame_groups(1, 1000, 1000).status.overflow, 0U);
    EXPECT_EQ(frame_groups(1, 10, 1000, 1).status.overflow, 1U)
        << "the host clears it, nobody else";
}

struct EmitInput {
    TestScene scene;
    ProjectedFrame frame;
    Words order, offset;  // by rank
    std::uint32_t intersections = 0, tiles_x = 0;

    explicit EmitInput(const SceneOptions& options)
        : scene(random_scene(options)), frame(project_on_device(scene.model, scene.camera)) {
        for (std::uint32_t i = 0; i < frame.visible.size(); ++i)
            if (frame.visible[i] == 1) order.push_back(i);
        std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
            return frame.bound[a].z < frame.bound[b].z;
        });
        for (const std::uint32_t i : order) {
            offset.push_back(intersections);
            intersections += frame.intersection_count[i];
        }
        tiles_x = static_cast<std::uint32_t>(scene.camera.width + TILE_SIZE - 1) / TILE_SIZE;
    }
};

struct Emitted {
    Words tile, splat, begin;
    gpu::FrameStatus status;
};

Emitted emit(const EmitInput& in, std::uint32_t capacity, bool cooperate = false) {
    Device& device = shared_device();
    const auto visible = static_cast<std::uint32_t>(in.order.size());
    std::vector<gpu::FrameStatus> counts(1);
    counts[0].visible = visible;
    counts[0].intersections = in.intersections;
    const GuardedBuffer status(device, "status", counts), order(device, "order", in.order),
        offset(device, "offset", in.offset), cover(device, "cover", in.frame.cover),
        tile(device, "tile from intersection", capacity * 4),
        splat(device, "splat from intersection", capacity * 4),
        begin(device, "first intersection", in.frame.visible.size() * 4),
        shape(device, "shape", in.frame.shape), bound(device, "bound", in.frame.bound),
        huge(device, "huge splats", (capacity / HUGE_INTERSECTIONS + 1) * 4);
    const gpu::IntersectionArgs args{capacity, in.tiles_x, 0, 0};
    run("emit", args, {status, order, offset, cover, tile, splat, begin, shape, bound, huge},
        visible, {{"COOPERATE", cooperate ? 1 : 0}});
    if (cooperate) {
        const Pipeline pipeline(device, "emit_huge");
        Commands commands(device);
        commands.begin();
        commands.dispatch(pipeline, args,
                          {status, order, offset, cover, tile, splat, huge, shape, bound},
                          EMIT_HUGE_GROUPS);
        commands.submit_and_wait();
    }
    EXPECT_TRUE(huge.intact());
    EXPECT_TRUE(tile.intact() && splat.intact() && begin.intact());
    return {tile.read<std::uint32_t>(), splat.read<std::uint32_t>(), begin.read<std::uint32_t>(),
            status.read<gpu::FrameStatus>()[0]};
}

/// emit_slots.comp on the same input.
Emitted emit_slots(const EmitInput& in, std::uint32_t capacity) {
    Device& device = shared_device();
    std::vector<gpu::FrameStatus> counts(1);
    counts[0].visible = static_cast<std::uint32_t>(in.order.size());
    counts[0].intersections = in.intersections;
    const std::uint32_t stored = std::min(in.intersections, capacity);
    const GuardedBuffer status(device, "status", counts), order(device, "order", in.order),
        offset(device, "offset", in.offset), cover(device, "cover", in.frame.cover),
        tile(device, "tile from intersection", capacity * 4),
        splat(device, "splat from intersection", capacity * 4),
        begin(device, "first intersection", in.frame.visible.size() * 4),
        shape(device, "shape", in.frame.shape), bound(device, "bound", in.frame.bound),
        in_use(device, "intersections in use", Words{stored});
    run("emit_slots", gpu::IntersectionArgs{capacity, in.tiles_x, 0, 0},
        {status, order, offset, cover, tile, splat, begin, shape, bound, in_use}, stored);
    EXPECT_TRUE(tile.intact() && splat.intact() && begin.intact() && in_use.intact());
    return {tile.read<std::uint32_t>(), splat.read<std::uint32_t>(), begin.read<std::uint32_t>(),
            status.read<gpu::FrameStatus>()[0]};
}

void expect_same_emission(const EmitInput& in) {
    const Emitted splats = emit(in, in.intersections), slots = emit_slots(in, in.intersections);
    EXPECT_EQ(splats.tile, slots.tile);
    EXPECT_EQ(splats.splat, slots.splat);
    for (const std::uint32_t i : in.order) EXPECT_EQ(splats.begin[i], slots.begin[i]) << i;
    EXPECT_EQ(std::memcmp(&splats.status, &slots.status, sizeof splats.status), 0);
}

const SceneOptions kEmitScene{.count = 120,
                              .width = 333,
                              .height = 210,
                              .sh_degree = 0,
                              .min_log_scale = -5,
                              .max_log_scale = -0.5,
                              .min_logit = -4,
                              .seed = 31};

TEST(Emit, intersections_follow_depth_and_cover) {
    const EmitInput in(kEmitScene);
    ASSERT_GT(in.intersections, 1000U);
    const Emitted out = emit(in, in.intersections);
    std::uint32_t slot = 0;
    for (std::uint32_t rank = 0; rank < in.order.size(); ++rank) {
        const std::uint32_t i = in.order[rank];
        EXPECT_EQ(out.begin[i], slot) << "splat " << i;
        for (const std::uint32_t tile : cover_tiles(in.frame.cover[i], in.tiles_x)) {
            ASSERT_EQ(out.tile[slot], tile) << "slot " << slot;
            ASSERT_EQ(out.splat[slot] & INTERSECTION_SPLAT_MASK, i) << "slot " << slot;
            ++slot;
        }
    }
    EXPECT_EQ(slot, in.intersections);
    EXPECT_EQ(out.status.overflow, 0U);
    EXPECT_EQ(out.status.intersections, in.intersections);
}

// Splats over hundreds of tiles: their intersections come from emit_huge, in the same slots.
TEST(Emit, huge_splats_get_the_same_intersections_from_a_workgroup_each) {
    SceneOptions options = kEmitScene;
    options.width = 900;
    options.height = 620;
    options.min_log_scale = -2.5;
    options.max_log_scale = 1;
    const EmitInput in(options);
    const Emitted alone = emit(in, in.intersections), together = emit(in, in.intersections, true);
    std::uint32_t huge = 0, most = 0;
    for (const std::uint32_t i : in.order) {
        huge += in.frame.intersection_count[i] > HUGE_INTERSECTIONS ? 1 : 0;
        most = std::max(most, in.frame.intersection_count[i]);
    }
    EXPECT_GT(huge, 20U);
    EXPECT_LT(huge, in.order.size()) << "some are meant to be small";
    EXPECT_EQ(most, 57U * 39U) << "one is meant to cover every tile";
    EXPECT_EQ(alone.status.huge_splats, huge);
    EXPECT_EQ(together.status.huge_splats, huge);
    EXPECT_EQ(alone.tile, together.tile);
    EXPECT_EQ(alone.splat, together.splat);
    EXPECT_EQ(alone.begin, together.begin);
    for (const std::uint32_t capacity :
         {1U, 300U, in.intersections / 2}) {  // guard words stand behind
        const Emitted cut = emit(in, capacity, true);
        EXPECT_TRUE(std::equal(cut.tile.begin(), cut.tile.end(), alone.tile.begin()));
        EXPECT_TRUE(std::equal(cut.splat.begin(), cut.splat.end(), alone.splat.begin()));
    }
}

TEST(Emit, a_scene_without_huge_splats_counts_none) {
    SceneOptions options = kEmitScene;
    options.max_log_scale = -2;
    const EmitInput in(options);
    for (const std::uint32_t count : in.frame.intersection_count)
        ASSERT_LE(count, HUGE_INTERSECTIONS);
    EXPECT_EQ(emit(in, in.intersections).status.huge_splats, 0U);
    EXPECT_EQ(emit(in, in.intersections, true).splat, emit(in, in.intersections).splat);
}

// Up to cells of 8 x 5 tiles, cut by the picture's edge; one splat and thousands; 64 ranks in the
// slots of one workgroup.
TEST(Emit, a_thread_for_each_slot_writes_the_same_intersections) {
    expect_same_emission(EmitInput(kEmitScene));
    SceneOptions options = kEmitScene;
    options.width = 900;
    options.height = 620;
    options.min_log_scale = -2.5;
    options.max_log_scale = 1;
    const EmitInput huge(options);
    expect_same_emission(huge);
    EXPECT_GT(emit_slots(huge, huge.intersections).status.huge_splats, 20U);
    options.count = 1;
    options.min_log_scale = 0.9;
    expect_same_emission(EmitInput(options));
    options = kEmitScene;
    options.count = 9000;
    options.min_log_scale = -9;
    options.max_log_scale = -6;
    const EmitInput small(options);
    ASSERT_GT(small.order.size(), 64U * 64U) << "three rounds of the search";
    EXPECT_LT(small.intersections, 2 * small.order.size());
    expect_same_emission(small);
}

TEST(Emit, a_thread_for_each_slot_writes_no_more_than_there_is_room_for) {
    const EmitInput in(kEmitScene);
    const Emitted whole = emit(in, in.intersections);
    for (const std::uint32_t capacity : {1U, 63U, 64U, 300U, in.intersections - 1}) {
        const Emitted cut = emit_slots(in, capacity);  // guard words stand behind
        EXPECT_TRUE(std::equal(cut.tile.begin(), cut.tile.end(), whole.tile.begin())) << capacity;
        EXPECT_TRUE(std::equal(cut.splat.begin(), cut.splat.end(), whole.splat.begin()));
    }
}

// The sum of the counts leaves 32 bits between two splats, or after the last one.
template <class Emits>
void expect_noted_totals(const Emits& emits) {
    for (const bool last : {false, true}) {
        EmitInput in(kEmitScene);
        if (last) {
            in.offset.back() = 0xffffff00U;
            in.intersections = 0xffffff00U + 0x200U;  // wraps to 0x100
        } else {
            in.offset[50] = 5;
        }
        const Emitted out = emits(in, 1000);
        EXPECT_EQ(out.status.overflow, OVERFLOW_TOTAL) << last;
        EXPECT_EQ(out.status.intersections, 0xffffffffU) << last;
    }
}

TEST(Emit, a_total_beyond_32_bits_is_noted) {
    expect_noted_totals([](const EmitInput& in, std::uint32_t room) { return emit(in, room); });
}

TEST(Emit, a_thread_for_each_slot_notes_a_total_beyond_32_bits) {
    expect_noted_totals(
        [](const EmitInput& in, std::uint32_t room) { return emit_slots(in, room); });
    EmitInput in(kEmitScene);  // offsets that neither grow nor begin at 0
    for (size_t rank = 0; rank < in.offset.size(); ++rank) in.offset[rank] = rank % 2 ? 10 : 400;
    EXPECT_EQ(emit_slots(in, 1000).status.overflow, OVERFLOW_TOTAL);
}

// Sums that left 32 bits: every other splat looks huge, and there are more of them than the list
// has room for.
TEST(Emit, a_total_beyond_32_bits_lists_no_more_huge_splats_than_fit) {
    EmitInput in(kEmitScene);
    for (size_t rank = 0; rank < in.offset.size(); ++rank) in.offset[rank] = rank % 2 ? 400 : 10;
    const Emitted out = emit(in, 1000, true);  // guard words stand behind the list
    EXPECT_EQ(out.status.overflow, OVERFLOW_TOTAL);
    EXPECT_GT(out.status.huge_splats, 2 * (1000 / HUGE_INTERSECTIONS + 1));
}

// Compares with every pixel: a block that the bits leave out has no pixel above the cut-off, and
// one that they name is within the ellipse and its slack.
TEST(Emit, block_bits_name_the_blocks_that_are_touched) {
    const EmitInput in(kEmitScene);
    const Emitted out = emit(in, in.intersections);
    const auto truth = reference::render(in.scene.model, in.scene.camera, {});
    const auto& kernel = reference::kernel_table(KERNEL_GAUSSIAN, Footprint::psi);
    size_t set = 0, needed = 0;
    for (std::uint32_t slot = 0; slot < in.intersections; ++slot) {
        const auto& s = truth.projected[out.splat[slot] & INTERSECTION_SPLAT_MASK];
        if (s.cull != reference::Cull::none) continue;
        for (std::uint32_t block = 0; block < 4; ++block) {
            const auto x0 = static_cast<int>(out.tile[slot] % in.tiles_x * 16 + block % 2 * 8);
            const auto y0 = static_cast<int>(out.tile[slot] / in.tiles_x * 16 + block / 2 * 8);
            const bool bit = (out.splat[slot] >> (INTERSECTION_BLOCK_SHIFT + block) & 1) != 0;
            bool seen = false;
            for (int k = 0; k < 64; ++k) {
                const double dx = s.mean_px.x - x0 - k % 8 - 0.5;
                const double dy = s.mean_px.y - y0 - k / 8 - 0.5;
                const double u = s.l11 * dx + s.l21 * dy, v = s.l22 * dy, q = u * u + v * v;
                seen |=
                    q < s.reach && s.opacity * kernel.value(q) >= ALPHA_CUTOFF_DEFAULT * (1 + 1e-4);
            }
            set += bit;
            needed += seen;
            EXPECT_TRUE(bit || !seen) << "slot " << slot << " block " << block;
            const double q = reference::smallest_q(s, x0, y0, x0 + 8, y0 + 8);
            EXPECT_TRUE(!bit || q <= s.reach * 1.003 + 3e-3)
                << "slot " << slot << " block " << block << ", q " << q << ", reach " << s.reach;
        }
    }
    EXPECT_GT(needed, in.intersections);
    EXPECT_LT(set, in.intersections * size_t{4}) << "some blocks must be left out";
}

TEST(Emit, intersections_beyond_the_capacity_are_left_out) {
    const EmitInput in(kEmitScene);
    const Emitted all = emit(in, in.intersections);
    for (const std::uint32_t capacity : {1U, 64U, in.intersections / 2, in.intersections - 1}) {
        const Emitted out = emit(in, capacity);  // guard words stand behind the capacity
        EXPECT_TRUE(std::equal(out.tile.begin(), out.tile.end(), all.tile.begin()));
        EXPECT_TRUE(std::equal(out.splat.begin(), out.splat.end(), all.splat.begin()));
    }
}

/// Lists one after the other, with these lengths; the order of the tiles.
Words tile_order(const Words& lengths) {
    const auto tiles = static_cast<std::uint32_t>(lengths.size());
    Words ranges;
    for (std::uint32_t begin = 0; const std::uint32_t length : lengths) {
        ranges.insert(ranges.end(), {begin, begin + length});
        begin += length;
    }
    const Words before = ranges;
    ranges.resize(std::size_t{tiles} * 4, 0);
    const GuardedBuffer range(shared_device(), "tile range", ranges);
    const Pipeline pipeline(shared_device(), "tile_order");
    Commands commands(shared_device());
    commands.begin();
    commands.dispatch(pipeline, gpu::IntersectionArgs{1000, 1, tiles, 0}, {range}, 1);
    commands.submit_and_wait();
    EXPECT_TRUE(range.intact());
    const Words after = range.read<std::uint32_t>();
    EXPECT_TRUE(std::equal(before.begin(), before.end(), after.begin())) << "a range changed";
    Words order;
    for (std::size_t i = 0; i < tiles; ++i) order.push_back(after[2 * (tiles + i)]);
    return order;
}

TEST(TileOrder, every_tile_comes_once_and_longer_lists_first) {
    Pcg32 rng(17);
    for (const std::uint32_t tiles : {1U, 255U, 256U, 7000U}) {
        Words lengths(tiles);
        for (std::uint32_t& length : lengths) length = rng.below(1U << rng.below(19));
        const Words order = tile_order(lengths);
        Words sorted = order;
        std::sort(sorted.begin(), sorted.end());
        for (std::uint32_t i = 0; i < tiles; ++i) ASSERT_EQ(sorted[i], i) << tiles;
        for (std::uint32_t i = 1; i < tiles; ++i) {  // a class is a sixteenth wide
            const std::uint32_t before = lengths[order[i - 1]], now = lengths[order[i]];
            EXPECT_LE(now < 16 ? now : now - now / 16, before) << i << " of " << tiles;
        }
    }
}

Words tile_ranges(const Words& tiles, std::uint32_t tile_count, std::uint32_t in_use) {
    Device& device = shared_device();
    const GuardedBuffer count(device, "intersections in use", Words{in_use}),
        tile(device, "tiles", tiles), range(device, "range", Words(tile_count * size_t{2}, 0));
    run("tile_ranges", gpu::IntersectionArgs{1000, 1, tile_count, 0}, {count, tile, range}, 1000);
    EXPECT_TRUE(range.intact());
    return range.read<std::uint32_t>();
}

TEST(TileRanges, runs_begin_and_end_where_the_tile_changes) {
    EXPECT_EQ(tile_ranges({1, 1, 1, 3, 6, 6}, 7, 6),
              (Words{0, 0, 0, 3, 0, 0, 3, 4, 0, 0, 0, 0, 4, 6}));
    EXPECT_EQ(tile_ranges({0, 0, 0}, 1, 3), (Words{0, 3}));
    EXPECT_EQ(tile_ranges({0, 1, 2}, 3, 3), (Words{0, 1, 1, 2, 2, 3}));
}

TEST(TileRanges, only_intersections_in_use_count) {
    EXPECT_EQ(tile_ranges({0, 1, 2}, 3, 0), (Words{0, 0, 0, 0, 0, 0}));
    EXPECT_EQ(tile_ranges({0, 1, 2}, 3, 2), (Words{0, 1, 1, 2, 0, 0}));
    EXPECT_EQ(tile_ranges({0, 1, 1}, 3, 2), (Words{0, 1, 1, 2, 0, 0}));
}

TEST(TileRanges, a_long_random_list_matches_the_host) {
    Pcg32 rng(5);
    Words tiles(1000);
    for (std::uint32_t& t : tiles) t = rng.below(300);
    std::sort(tiles.begin(), tiles.end());
    Words expected(600, 0);
    for (std::uint32_t j = 0; j < 1000; ++j) {
        if (j == 0 || tiles[j - 1] != tiles[j]) expected[tiles[j] * 2] = j;
        expected[tiles[j] * 2 + 1] = j + 1;
    }
    EXPECT_EQ(tile_ranges(tiles, 300, 1000), expected);
}

TEST(ListLengths, the_longest_is_found_and_lists_beyond_the_capacity_are_noted) {
    Device& device = shared_device();
    for (const std::uint32_t tiles : {1U, 64U, 1000U}) {
        std::vector<glm::uvec2> ranges(tiles);
        for (std::uint32_t t = 0; t < tiles; ++t) ranges[t] = {t * 500, t * 500 + t % 97};
        ranges[tiles / 2].y = ranges[tiles / 2].x + 300;
        for (const std::uint32_t capacity : {299U, 300U}) {
            std::vector<gpu::FrameStatus> before(1);
            before[0].overflow = OVERFLOW_INTERSECTIONS;
            const GuardedBuffer status(device, "status", before), range(device, "ranges", ranges);
            run("list_lengths", gpu::IntersectionArgs{0, 1, tiles, capacity}, {status, range},
                tiles);
            const auto after = status.read<gpu::FrameStatus>()[0];
            EXPECT_EQ(after.longest_list, 300U);
            EXPECT_EQ(after.overflow,
                      OVERFLOW_INTERSECTIONS | (capacity < 300 ? OVERFLOW_LISTS : 0U));
        }
    }
}

}  // namespace
}  // namespace darb::test
