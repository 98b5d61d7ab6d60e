// SPDX-License-Identifier: MIT
// Clone, split and removal: each rule of the schedule on one splat, then the cap.
#include "engine/reference/reference_density_control.h"

#include <gtest/gtest.h>

#include <cmath>

namespace darb::reference {
namespace {

using enum DensityAction;

struct Candidate {
    double gradient_sum = 0;
    std::uint32_t seen = 1;
    double scale = 0.05;  // the largest; extent 10, so 0.1 is the border of split, 1 of removal
    double opacity = 0.5;
};

std::vector<DensityAction> act(const std::vector<Candidate>& all, DensitySettings settings = {}) {
    settings.scene_extent = 10;
    std::vector<double> sums;
    std::vector<std::uint32_t> seen;
    std::vector<float> scales, logits;
    for (const Candidate& c : all) {
        sums.push_back(c.gradient_sum);
        seen.push_back(c.seen);
        scales.insert(scales.end(), {-9.0F, static_cast<float>(std::log(c.scale)), -8.0F});
        logits.push_back(static_cast<float>(std::log(c.opacity / (1 - c.opacity))));
    }
    return density_actions(sums, seen, scales, logits, settings);
}

TEST(DensityActions, SmallGradient_Keeps) {
    EXPECT_EQ(act({{.gradient_sum = 1.9e-4}}), std::vector{keep});
    EXPECT_EQ(act({{.gradient_sum = 1.0, .seen = 10000}}), std::vector{keep});
    EXPECT_EQ(act({{.gradient_sum = 0, .seen = 0}}), std::vector{keep});
}

TEST(DensityActions, MeanGradientAtThreshold_Grows) {
    EXPECT_EQ(act({{.gradient_sum = 2e-4}}), std::vector{clone});
    EXPECT_EQ(act({{.gradient_sum = 0.03, .seen = 100}}), std::vector{clone});
}

TEST(DensityActions, WideSplat_Splits) {
    EXPECT_EQ(act({{.gradient_sum = 1e-3, .scale = 0.099}}), std::vector{clone});
    EXPECT_EQ(act({{.gradient_sum = 1e-3, .scale = 0.101}}), std::vector{split});
}

TEST(DensityActions, FaintSplat_IsRemovedEvenIfItWouldGrow) {
    EXPECT_EQ(act({{.opacity = 0.0049}}), std::vector{remove});
    EXPECT_EQ(act({{.opacity = 0.0051}}), std::vector{keep});
    EXPECT_EQ(act({{.gradient_sum = 1, .opacity = 0.004}}), std::vector{remove});
}

TEST(DensityActions, WideSplat_IsRemovedOnlyWhenAskedAndNotIfItsChildrenFit) {
    EXPECT_EQ(act({{.scale = 1.1}}), std::vector{keep});
    const DensitySettings prune{.prune_wide = true};
    EXPECT_EQ(act({{.scale = 1.1}}, prune), std::vector{remove});
    EXPECT_EQ(act({{.scale = 0.9}}, prune), std::vector{keep});
    EXPECT_EQ(act({{.gradient_sum = 1, .scale = 1.5}}, prune), std::vector{split});
    EXPECT_EQ(act({{.gradient_sum = 1, .scale = 1.7}}, prune), std::vector{remove});
}

TEST(DensityActions, NotANumberGradient_Keeps) {
    EXPECT_EQ(act({{.gradient_sum = std::nan("")}}), std::vector{keep});
}

TEST(DensityActions, Cap_AdmitsTheLargestGradients) {
    const std::vector<Candidate> all = {{.gradient_sum = 1e-3},
                                        {.gradient_sum = 3e-3},
                                        {.opacity = 0.001},
                                        {.gradient_sum = 2e-3, .scale = 0.5},
                                        {.gradient_sum = 1e-3}};
    EXPECT_EQ(count_after(act(all)), 8U);
    const auto capped = act(all, {.max_splats = 6});
    EXPECT_EQ(capped, (std::vector{keep, clone, remove, split, keep}));
    EXPECT_EQ(count_after(capped), 6U);
    EXPECT_EQ(act(all, {.max_splats = 7}), (std::vector{clone, clone, remove, split, keep}));
    EXPECT_EQ(act(all, {.max_splats = 1}), (std::vector{keep, keep, remove, keep, keep}));
}

TEST(DensityActions, NoSplats_GivesNone) {
    EXPECT_TRUE(act({}).empty());
    EXPECT_EQ(count_after({}), 0U);
}

TEST(SplitOffset, TurnsAndScalesTheDraw) {
    const float root = std::sqrt(0.5F);
    const float quarter_about_z[4] = {root, 0, 0, root};
    const float log_scale[3] = {std::log(2.0F), 0, 0};
    const glm::dvec3 offset = split_offset(quarter_about_z, log_scale, {1, 0, 0}, 1.5);
    EXPECT_NEAR(offset.x, 0, 1e-6);
    EXPECT_NEAR(offset.y, 3, 1e-6);
    EXPECT_NEAR(offset.z, 0, 1e-6);
    EXPECT_NEAR(std::exp(split_log_scale(log_scale[0])), 2 / 1.6, 1e-6);
}

TEST(ResetOpacity, OnlyLowers) {
    EXPECT_NEAR(1 / (1 + std::exp(-reset_opacity(3.0F))), 0.01, 1e-7);
    EXPECT_EQ(reset_opacity(-7.0F), -7.0F);
}

}  // namespace
}  // namespace darb::reference
