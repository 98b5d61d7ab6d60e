// SPDX-License-Identifier: MIT
// The control of frames in motion on modelled devices, and the order of importance.
#include "viewer/picture_pacing.h"

#include <gtest/gtest.h>

#include <cmath>

#include "viewer/scene.h"

namespace darb {
namespace {

// A device on which a whole picture takes this long for its splats and its pixels.
struct Modelled {
    double fixed_ms, splats_ms, pixels_ms;
    MotionCost cost(const MotionQuality& q) const {
        return {fixed_ms, splats_ms * q.splats, pixels_ms * q.scale * q.scale};
    }
};

MotionQuality after(MotionControl& control, const Modelled& device, int frames) {
    for (int i = 0; i < frames; ++i) control.measured(device.cost(control.quality()));
    return control.quality();
}

TEST(MotionControl, Every_slow_device_ends_within_the_target) {
    for (const Modelled& device :
         {Modelled{5, 80, 10}, Modelled{5, 10, 300}, Modelled{10, 90, 90}, Modelled{2, 900, 60}}) {
        MotionControl control(33);
        control.start(motion_shares(1'000'000, 0.5));
        const double ms = device.cost(after(control, device, 300)).total_ms();
        EXPECT_LE(ms, 33) << device.splats_ms << ", " << device.pixels_ms;
        EXPECT_GE(ms, 15) << device.splats_ms << ", " << device.pixels_ms;
    }
}

TEST(MotionControl, What_costs_more_is_what_is_given_up) {
    MotionControl control(33);
    control.start(motion_shares(1'000'000, 0.7));
    const MotionQuality many = after(control, {5, 200, 5}, 300);
    EXPECT_LT(many.splats, 0.25);
    EXPECT_GE(many.scale, 0.5);
    control.start(motion_shares(1'000'000, 0.7));
    const MotionQuality large = after(control, {5, 5, 200}, 300);
    EXPECT_GE(large.splats, 0.25);
    EXPECT_LT(large.scale, 0.5);
}

TEST(MotionControl, A_quick_device_gets_the_whole_picture_within_a_second) {
    for (const double most : {0.5, 0.499, 0.4, 0.02}) {  // 0.499: of an odd number of splats
        MotionControl control(33);
        control.start(motion_shares(1'000'000, most));
        EXPECT_EQ(after(control, {1, 2, 3}, 120), MotionQuality()) << most;
        control.start(motion_shares(1'000'000, most));
        EXPECT_LT(after(control, {1, 60, 3}, 300).splats, 1) << most;
    }
}

// There is nothing between the share that is kept in order and all splats, so that pictures do not
// alternate.
TEST(MotionControl, It_comes_to_rest) {
    for (const double most : {0.5, 0.4})
        for (const Modelled& device :
             {Modelled{2, 45, 2}, Modelled{5, 30, 30}, Modelled{20, 5, 5}, Modelled{2, 24, 2}}) {
            MotionControl control(33);
            control.start(motion_shares(1'000'000, most));
            const MotionQuality settled = after(control, device, 300);
            for (int i = 0; i < 200; ++i) EXPECT_EQ(after(control, device, 1), settled) << i;
        }
}

// Pixels go first where both cost alike: half the sides cost less than an eighth of the splats.
TEST(MotionControl, Resolution_is_given_up_before_splats) {
    MotionControl control(33);
    control.start(motion_shares(1'000'000, 0.5));
    const MotionQuality q = after(control, {3, 60, 60}, 300);
    EXPECT_LE(q.scale, 0.5);
    EXPECT_GE(q.splats, 0.17);
}

// Among the shares that fit into 0.85 of the target, the one nearest by motion_error is taken; one
// that takes 0.7 to 1.0 of the target is kept.
TEST(MotionControl, A_change_takes_the_nearest_that_fits_and_then_keeps_it) {
    const std::vector<double> shares = motion_shares(1'000'000, 0.5);
    const Modelled device{3, 90, 60};
    MotionControl control(33);
    control.start(shares);
    const MotionQuality start = control.quality();
    ASSERT_GT(device.cost(start).total_ms(), 33);
    const MotionQuality changed = after(control, device, 2);
    ASSERT_NE(changed, start);
    EXPECT_LE(device.cost(changed).total_ms(), 0.85 * 33 + 1e-9);
    for (const double share : shares)
        for (int eighths = 2; eighths <= 8; ++eighths) {
            const MotionQuality other{eighths / 8.0, share};
            const bool in_reach = share <= 2 * start.splats && other.scale <= 2 * start.scale;
            if (in_reach && device.cost(other).total_ms() <= 0.85 * 33) {
                EXPECT_GE(motion_error(other), motion_error(changed)) << share << ' ' << eighths;
            }
        }
    const double ms = device.cost(changed).total_ms();
    for (const double of_target : {0.71, 0.99}) {
        const double factor = of_target * 33 / ms;
        EXPECT_EQ(after(control, {3 * factor, 90 * factor, 60 * factor}, 100), changed);
    }
}

TEST(MotionShares, fall_to_ten_thousand_splats) {
    const std::vector<double> shares = motion_shares(160'000, 0.5);
    ASSERT_EQ(shares.size(), 7u);
    EXPECT_EQ(shares.front(), 0.5);
    EXPECT_NEAR(shares.back(), 1.0 / 16, 1e-9);
    EXPECT_EQ(motion_shares(100, 0.5), std::vector<double>{0.5});
}

TEST(MotionControl, One_slow_frame_changes_nothing) {
    MotionControl control(33);
    control.start(motion_shares(1'000'000, 0.5));
    const Modelled device{5, 20, 20};
    const MotionQuality settled = after(control, device, 300);
    control.measured({500, 20, 20});
    EXPECT_EQ(after(control, device, 1), settled);
}

TEST(MotionControl, Where_nothing_helps_a_fifth_of_the_time_is_left_for_the_picture) {
    MotionControl control(33);
    control.start(motion_shares(1'000'000, 0.7));
    const Modelled device{80, 10, 10};
    const MotionCost cost = device.cost(after(control, device, 300));
    EXPECT_GT(cost.splats_ms + cost.pixels_ms, 3);
}

TEST(MotionControl, Ten_thousand_splats_are_always_drawn) {
    MotionControl control(33);
    control.start(motion_shares(20'000, 0.5));
    EXPECT_EQ(after(control, {0, 5000, 5}, 300).splats, 0.5);
    control.start(motion_shares(100'000, 0.5));
    EXPECT_NEAR(after(control, {0, 5000, 5}, 300).splats, 0.125, 0.025);
}

TEST(MotionCost, Passes_are_told_apart) {
    const std::vector<PassTime> passes = {{"project", 4}, {"emit", 2}, {"blend", 8}};
    const MotionCost cost = motion_cost(20, passes);
    EXPECT_DOUBLE_EQ(cost.splats_ms, 5);
    EXPECT_DOUBLE_EQ(cost.pixels_ms, 9);
    EXPECT_DOUBLE_EQ(cost.total_ms(), 20);
}

// Splat i: opacity logit and log scale as given, one unit wide in the third axis.
SplatModel scene(const std::vector<std::array<float, 3>>& splats) {
    SplatModel m;
    m.sh_degree = 1;
    m.resize(splats.size());
    for (size_t i = 0; i < splats.size(); ++i) {
        m.opacity_logit[i] = splats[i][0];
        for (size_t c = 0; c < 2; ++c) m.log_scale[3 * i + c] = splats[i][1];
        m.log_scale[3 * i + 2] = -20;
        m.position[3 * i] = splats[i][2];
        for (size_t c = 0; c < 9; ++c) m.sh_rest[9 * i + c] = static_cast<float>(i);
    }
    return m;
}

TEST(Importance, Large_opaque_and_near_come_first) {
    const SplatModel m = scene({{-4, 0, 0},    // nearly transparent
                                {2, -3, 0},    // small
                                {2, 0, 0},     // the most
                                {2, 1, 1000},  // large and very far
                                {1, 0, 0}});   // less opaque
    const Bounds bounds{glm::dvec3(0.0), 1};
    EXPECT_EQ(most_important(m, bounds, 5), (std::vector<std::uint32_t>{2, 4, 0, 1, 3}));
    EXPECT_EQ(most_important(m, bounds, 2), (std::vector<std::uint32_t>{2, 4}));
    EXPECT_TRUE(most_important(m, bounds, 0).empty());
}

}  // namespace
}  // namespace darb
