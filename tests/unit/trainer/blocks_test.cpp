// SPDX-License-Identifier: MIT
// The parts of a run in blocks that need no device: cells, cameras, surroundings, cut and join,
// the manifest.
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <filesystem>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/rng.h"
#include "engine/ranks/ranks.h"
#include "engine/raster/gpu_splats.h"
#include "engine/scene/edit_splats.h"
#include "trainer/blocks/block_scene.h"
#include "trainer/blocks/manifest.h"
#include "trainer/blocks/partition.h"

namespace darb {
namespace {

// A camera at `eye`, z up in the world, that looks down by `tilt` in a heading; radians.
View flying_view(const glm::dvec3& eye, double heading, double tilt) {
    const glm::dvec3 forward(std::cos(heading) * std::cos(tilt), std::sin(heading) * std::cos(tilt),
                             -std::sin(tilt));
    const glm::dvec3 right(std::sin(heading), -std::cos(heading), 0);
    View view;
    view.camera.width = 100;
    view.camera.height = 80;
    view.camera.fx = view.camera.fy = 120;
    view.camera.cx = 50;
    view.camera.cy = 40;
    view.camera.rotation = glm::transpose(glm::dmat3(right, glm::cross(forward, right), forward));
    view.camera.translation = -(view.camera.rotation * eye);
    return view;
}

// Denser at one end, 30 x 10 units, some height.
std::vector<double> ground_points(std::size_t count, Pcg32& rng) {
    std::vector<double> points;
    for (std::size_t p = 0; p < count; ++p) {
        const double along = rng.uniform(0, 1);
        points.insert(points.end(), {30 * along * along, rng.uniform(0, 10), rng.uniform(0, 0.5)});
    }
    return points;
}

GroundPlane plane_of(const std::vector<double>& points) {
    return ground_plane({flying_view({0, 0, 5}, 0.3, 0.9), flying_view({0, 0, 5}, 2.0, 1.2)},
                        points);
}

TEST(GroundPlane, up_is_that_of_level_tilted_and_downward_cameras) {
    Pcg32 rng(1);
    const std::vector<double> points = ground_points(100, rng);
    for (const double tilt : {-0.2, 0.0, 0.7, 1.5707}) {
        std::vector<View> views;
        for (int v = 0; v < 9; ++v) views.push_back(flying_view({0, 0, 5}, 0.7 * v, tilt));
        const GroundPlane plane = ground_plane(views, points);
        EXPECT_GT(plane.up.z, 0.9999) << "tilt " << tilt;
        EXPECT_GT(std::abs(plane.u.x), 0.9999) << "the points lie along x";
    }
    // One heading alone decides by what is up in the picture.
    const GroundPlane one =
        ground_plane({flying_view({0, 0, 5}, 0.3, 0.1), flying_view({4, 0, 5}, 0.3, 0.1)}, points);
    EXPECT_GT(one.up.z, 0.8);
}

TEST(Partition, cells_are_balanced_and_hold_every_point_once) {
    Pcg32 rng(2);
    const std::vector<double> points = ground_points(6'000, rng);
    const Partition cells = partition(plane_of(points), points, 4, 3);
    ASSERT_EQ(cells.cells.size(), 12u);
    std::vector<std::size_t> held(12);
    for (std::size_t p = 0; p < points.size() / 3; ++p) {
        const glm::dvec3 at(points[3 * p], points[3 * p + 1], points[3 * p + 2]);
        int holders = 0;
        for (const Cell& cell : cells.cells) holders += cell.holds(cells.plane.at(at)) ? 1 : 0;
        ASSERT_EQ(holders, 1) << p;
        ++held[cells.cell_of(at)];
    }
    const std::vector<CellCount> counts = count_points(cells, points);
    for (std::size_t c = 0; c < 12; ++c) {
        EXPECT_NEAR(double(held[c]), 500, 3) << c;
        EXPECT_EQ(held[c], counts[c].own);
        EXPECT_GT(counts[c].with_margin, counts[c].own);
        EXPECT_LT(counts[c].with_margin, 2 * counts[c].own);
    }
    // Wherever a splat wanders to.
    for (const double far : {-1e9, 1e9}) EXPECT_LT(cells.cell_of({far, -far, far}), 12u);
}

TEST(Partition, margins_reach_into_the_neighbours_by_their_share) {
    Pcg32 rng(3);
    std::vector<double> points;
    for (int p = 0; p < 4'000; ++p)
        points.insert(points.end(), {rng.uniform(0, 20), rng.uniform(0, 10), 0.0});
    const Partition cells = partition(plane_of(points), points, 2, 1);
    const Cell& cell = cells.cells[0];
    EXPECT_NEAR(cell.margin.x, kMarginShare * 0.9 * 10, 0.1);
    const double edge = cell.high.x;
    EXPECT_FALSE(cell.holds({edge, 5}));
    EXPECT_TRUE(cell.holds_with_margin({edge + 0.9 * cell.margin.x, 5}));
    EXPECT_FALSE(cell.holds_with_margin({edge + 1.1 * cell.margin.x, 5}));
}

TEST(Partition, more_cells_than_places_are_refused) {
    const std::vector<double> points{0, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0};
    EXPECT_NO_THROW(partition(plane_of(points), points, 2, 1));
    EXPECT_THROW(partition(plane_of(points), points, 3, 1), Error);
    EXPECT_THROW(partition(plane_of(points), points, 2, 2), Error);
}

TEST(Partition, grids_follow_the_ground) {
    Pcg32 rng(4);
    const std::vector<double> points = ground_points(2'000, rng);
    const GroundPlane plane = plane_of(points);
    for (const int blocks : {1, 2, 3, 4, 7, 12, 30}) {
        const Grid grid = grid_for(blocks, plane, points);
        EXPECT_GE(grid.columns * grid.rows, blocks);
        EXPECT_LE(grid.columns * grid.rows, blocks + 2);
        EXPECT_GE(grid.columns, grid.rows);
    }
}

TEST(CameraChoice, takes_who_sees_enough_and_gives_each_view_to_a_cell) {
    const auto chosen = choose_views(
        {{0.5, 0.3}, {0.05, 0.3}, {0.01, 0.02}, {0, 0}, {0.2, 0.06}, {0.06, 0.01}}, 0.05);
    EXPECT_EQ(chosen[0], (std::vector<std::size_t>{0, 1, 4, 5}));
    EXPECT_EQ(chosen[1], (std::vector<std::size_t>{0, 1, 2, 4}));
}

TEST(CameraChoice, gives_a_cell_that_few_see_those_that_see_most_of_it) {
    const auto chosen =
        choose_views({{0.5, 0.01}, {0.5, 0.04}, {0.5, 0}, {0.5, 0.02}, {0.5, 0.03}}, 0.05);
    EXPECT_EQ(chosen[1], (std::vector<std::size_t>{1, 3, 4}));
}

// 20 x 20 splats of different opacities on the ground from 0 to 20.
SplatModel flat_model() {
    SplatModel model;
    model.resize(400);
    for (std::size_t i = 0; i < 400; ++i) {
        model.position[3 * i] = static_cast<float>(i % 20) + 0.5f;
        model.position[3 * i + 1] = static_cast<float>(i / 20) + 0.5f;
        model.rotation[4 * i] = 1;
        for (std::size_t a = 0; a < 3; ++a) model.log_scale[3 * i + a] = -3;
        model.opacity_logit[i] = static_cast<float>(i % 7);
    }
    return model;
}

Partition two_cells() {
    Partition cells{{{0, 0, 1}, {1, 0, 0}, {0, 1, 0}}, 2, 1, {}};
    constexpr double kFar = std::numeric_limits<double>::infinity();
    cells.cells = {{{-kFar, -kFar}, {10, kFar}, {2, 2}}, {{10, -kFar}, {kFar, kFar}, {2, 2}}};
    return cells;
}

TEST(BlockScene, trains_cell_and_margin_and_freezes_what_cameras_see_around) {
    const SplatModel coarse = flat_model();
    const Partition cells = two_cells();
    const std::vector<View> high{flying_view({10, 10, 100}, 0, 1.5707)};
    const BlockRegion region{cells, 0, {false, false}};
    const BlockStart all = block_start(coarse, region, {}, high, 2);
    EXPECT_EQ(all.frozen, 128u) << "of the 160 beyond 12, in whole units";
    EXPECT_EQ(all.model.size(), 128u + 240u);
    EXPECT_EQ(all.model.sh_degree, 2);
    EXPECT_EQ(all.model.sh_rest.size(), all.model.size() * 24);
    for (std::size_t i = 0; i < all.model.size(); ++i)
        EXPECT_EQ(position_of(all.model, i).x > 12, i < all.frozen);
    for (std::size_t i = 0; i < all.frozen; ++i)
        EXPECT_GT(all.model.opacity_logit[i], 0) << "the least opaque are left out";
    const std::vector<View> away{flying_view({-50, 10, 20}, 3.14159, 0.5)};
    EXPECT_EQ(block_start(coarse, region, {}, away, 0).frozen, 0u);
}

// 20 splats of a finished cell stand in the margin of the next one, in place of the coarse ones.
TEST(BlockScene, what_is_done_beside_a_block_is_frozen_and_not_trained_again) {
    const SplatModel coarse = flat_model();
    const Partition cells = two_cells();
    const std::vector<View> high{flying_view({10, 10, 100}, 0, 1.5707)};
    SplatModel beside =
        cut_to_margin(cut_to_cell(coarse, 0, cells, 0), cells.cells[1], cells.plane);
    ASSERT_EQ(beside.size(), 40u) << "of 8 to 10";
    for (float& dc : beside.sh_dc) dc = 7;
    const BlockRegion region{cells, 1, {true, false}};
    const BlockStart start = block_start(coarse, region, beside, high, 0);
    EXPECT_EQ(start.frozen, 192u) << "of 160 up to 8 and 40, in whole units";
    EXPECT_EQ(start.model.size(), 192u + 200u);
    std::size_t fixed = 0;
    for (std::size_t i = 0; i < start.frozen; ++i) {
        const double x = position_of(start.model, i).x;
        EXPECT_EQ(x > 8, start.model.sh_dc[3 * i] == 7);
        fixed += x > 8 ? 1 : 0;
    }
    EXPECT_EQ(fixed, 40u) << "none of these is left out";
    for (std::size_t i = start.frozen; i < start.model.size(); ++i)
        EXPECT_GT(position_of(start.model, i).x, 10);
}

TEST(Partition, cells_of_a_round_do_not_lie_side_by_side) {
    Pcg32 rng(6);
    const std::vector<double> points = ground_points(9'000, rng);
    const Partition cells = partition(plane_of(points), points, 5, 4);
    std::array<int, Partition::kRounds> members{};
    for (std::size_t a = 0; a < cells.cells.size(); ++a) {
        ++members[std::size_t(cells.round_of(a))];
        for (std::size_t b = 0; b < a; ++b) {
            const Cell &one = cells.cells[a], &two = cells.cells[b];
            const bool touch = one.low.x <= two.high.x && two.low.x <= one.high.x &&
                               one.low.y <= two.high.y && two.low.y <= one.high.y;
            EXPECT_FALSE(touch && cells.round_of(a) == cells.round_of(b)) << a << " " << b;
        }
    }
    for (const int count : members) EXPECT_GE(count, 4);
}

TEST(BlockScene, cut_and_joined_parts_hold_each_place_once) {
    const SplatModel coarse = flat_model();
    const Partition cells = two_cells();
    const std::vector<View> high{flying_view({10, 10, 100}, 0, 1.5707)};
    std::vector<SplatModel> parts;
    for (std::size_t c = 0; c < 2; ++c) {
        const BlockStart start =
            block_start(coarse, {cells, c, {false, false}}, {}, high, static_cast<int>(c));
        parts.push_back(cut_to_cell(start.model, start.frozen, cells, c));
        EXPECT_EQ(parts.back().size(), 200u);
        for (std::size_t i = 0; i < 200; ++i)
            EXPECT_EQ(cells.cell_of(position_of(parts.back(), i)), c);
    }
    const SplatModel joined = join_parts(parts);
    EXPECT_EQ(joined.size(), 400u);
    EXPECT_EQ(joined.sh_degree, 1);
    EXPECT_EQ(joined.sh_rest.size(), 400u * 9);
    EXPECT_EQ(position_of(joined, 399), glm::dvec3(19.5, 19.5, 0));
}

TEST(BlockScene, a_block_has_its_photos_and_every_point) {
    Dataset whole;
    for (int v = 0; v < 4; ++v) whole.views.emplace_back().name = std::to_string(v);
    whole.points.position = {1, 2, 3};
    whole.points.colour = {4, 5, 6};
    whole.points.seen_begin = {0, 1};
    whole.points.seen_by = {3};
    whole.views[3].depth = "depths/3.png";
    whole.depth_scale = 2;
    const Dataset block = block_dataset(whole, {1, 3});
    ASSERT_EQ(block.views.size(), 2u);
    EXPECT_EQ(block.views[1].name, "3");
    EXPECT_EQ(block.views[1].depth, "depths/3.png");
    EXPECT_EQ(block.depth_scale, 2);
    EXPECT_EQ(block.points.size(), 1u);
    EXPECT_TRUE(block.points.seen_by.empty()) << "by numbers of other views";
}

TEST(PartOptions, blocks_share_out_the_splats_by_points) {
    TrainOptions options;
    options.max_splats = 10'000;
    options.depth = true;
    options.depth_weight = 0.5f;
    const TrainOptions block = block_options(options, {200, 300}, 1'000, 640, 900);
    EXPECT_EQ(block.max_splats, 3'640u);
    EXPECT_TRUE(block.depth && block.depth_weight == 0.5f) << "all else is as it was";
    EXPECT_EQ(block_options(options, {200, 300}, 1'000, 640, 5'000).max_splats, 5'000u);
    options.max_splats.reset();
    EXPECT_FALSE(block_options(options, {200, 300}, 1'000, 640, 900).max_splats);
    EXPECT_EQ(coarse_splats(80'000), 10'000u);
    EXPECT_EQ(coarse_splats(500), 500u);
}

class BlocksManifestFile : public testing::Test {
  protected:
    void SetUp() override {
        manifest_.settings = R"({"iterations":100,"seed":0})";
        manifest_.dataset = "abc";
        manifest_.max_memory = 5'000;
        manifest_.coarse_scale = 0.25;
        manifest_.cells = two_cells();
        manifest_.coarse = {PartState::done, "", 0, 100, 100, 4'000, 1.5};
        manifest_.blocks = {{"0x0", 7, {0, 2}, {PartState::failed, "disk full", 64, 0, 0, 9, 2}},
                            {"1x0", 8, {1}, {}}};
        write_manifest(path_, manifest_);
    }
    void TearDown() override { std::filesystem::remove(path_); }
    // The reason that check_manifest gives; "": none.
    std::string refusal(const BlocksManifest& now, const Grid& asked = {0, 0}) {
        try {
            check_manifest(read_manifest(path_), path_, now, asked);
        } catch (const Error& e) {
            return e.what();
        }
        return "";
    }
    const std::filesystem::path path_ =
        std::filesystem::path(testing::TempDir()) / ("darb_manifest_" + std::to_string(::getpid()));
    BlocksManifest manifest_;
};

TEST_F(BlocksManifestFile, comes_back_as_it_was) {
    const BlocksManifest read = read_manifest(path_);
    EXPECT_EQ(read.cells.columns, 2);
    EXPECT_EQ(read.max_memory, 5'000u);
    EXPECT_EQ(read.coarse.state, PartState::done);
    EXPECT_EQ(read.coarse.peak_bytes, 4'000u);
    ASSERT_EQ(read.blocks.size(), 2u);
    EXPECT_EQ(read.blocks[0].part.state, PartState::failed);
    EXPECT_EQ(read.blocks[0].part.error, "disk full");
    EXPECT_EQ(read.blocks[0].views, (std::vector<std::size_t>{0, 2}));
    EXPECT_EQ(read.coarse_scale, 0.25);
    EXPECT_EQ(read.blocks[1].part.state, PartState::waiting);
    EXPECT_EQ(refusal(manifest_, {2, 1}), "");
}

TEST_F(BlocksManifestFile, of_something_else_is_refused_with_what_differs) {
    BlocksManifest now = manifest_;
    now.settings = R"({"iterations":200,"seed":0})";
    EXPECT_NE(refusal(now).find("iterations: 100 then, 200 now"), std::string::npos);
    EXPECT_EQ(refusal(now).find("seed"), std::string::npos);
    EXPECT_NE(refusal(manifest_, {3, 1}).find("2x1 then, 3x1 now"), std::string::npos);
    now = manifest_;
    now.dataset = "abd";
    EXPECT_NE(refusal(now).find("the data set"), std::string::npos);
}

TEST_F(BlocksManifestFile, damaged_is_an_error_that_names_it) {
    const std::string text = read_text_file(path_);
    for (const std::string& damaged :
         {std::string("{"), std::string("[]"), text.substr(0, text.size() / 2),
          std::string(R"({"version":1})")}) {
        write_file_atomic(path_, damaged);
        EXPECT_THROW(read_manifest(path_), Error) << damaged;
    }
    std::string other = text;
    other.replace(other.find("\"failed\""), 8, "\"fallen\"");
    write_file_atomic(path_, other);
    EXPECT_THROW(read_manifest(path_), Error);
    other = text;
    other.replace(other.find("\"columns\": 2"), 12, "\"columns\": 3");
    write_file_atomic(path_, other);
    EXPECT_THROW(read_manifest(path_), Error);
}

// Runs every rank, each with what a call of gather returns to all.
class Turns : public OneRank {
  public:
    Turns(int rank, int count) : rank_(rank), count_(count) {}
    int rank() const override { return rank_; }
    int count() const override { return count_; }
    std::vector<Bytes> gather(std::span<const std::byte>) override { return all; }
    std::vector<Bytes> all;

  private:
    int rank_, count_;
};

TEST(Turns, items_go_to_and_fro_and_come_back_in_their_order) {
    for (const int count : {1, 2, 3, 4})
        for (const std::size_t items : {0, 1, 5, 8, 11}) {
            Turns first(0, count);
            std::vector<std::size_t> expected, of_rank(static_cast<std::size_t>(count));
            for (int r = 0; r < count; ++r) {
                std::vector<std::size_t> own;
                for (std::size_t i = 0; i < items; ++i)
                    if (has_turn(Turns(r, count), i)) own.push_back(100 + i);
                of_rank[static_cast<std::size_t>(r)] = own.size();
                const auto bytes = std::as_bytes(std::span(own));
                first.all.emplace_back(bytes.begin(), bytes.end());
            }
            for (std::size_t i = 0; i < items; ++i) expected.push_back(100 + i);
            EXPECT_EQ(by_turns(first, std::vector<std::size_t>()), expected) << count;
            EXPECT_LE(*std::max_element(of_rank.begin(), of_rank.end()),
                      *std::min_element(of_rank.begin(), of_rank.end()) + 1);
        }
    EXPECT_NE(turn_of(0, 2), turn_of(2, 2)) << "of two kernels by turns, no rank has one alone";
}

}  // namespace
}  // namespace darb
