// SPDX-License-Identifier: MIT
// Regions as they are written on a command line: what they hold, and what is no region.
#include "engine/scene/region.h"

#include <gtest/gtest.h>

#include "engine/core/error.h"
#include "tests/support/splat_files.h"

namespace darb::test {
namespace {

Camera upright_camera() {  // y points down
    Camera camera;
    camera.width = camera.height = 64;
    camera.fx = camera.fy = 64;
    camera.cx = camera.cy = 32;
    camera.translation = {0, 0, 5};
    return camera;
}

Region region(const std::string& text) {
    const std::vector<Camera> cameras{upright_camera()};
    return region_from("--roi", text, SplatModel(), cameras);
}

std::string refusal_of(const std::string& text) {
    try {
        region(text);
    } catch (const Error& e) {
        return e.what();
    }
    return "";
}

TEST(Region, box_and_sphere_hold_what_their_numbers_say) {
    const Region box = region("box:0,-1,2,1,1,3");
    EXPECT_TRUE(box.contains({0, -1, 2}));
    EXPECT_TRUE(box.contains({1, 1, 3}));
    EXPECT_FALSE(box.contains({1.001, 0, 2.5}));
    const Region sphere = region("sphere:1,0,0,2");
    EXPECT_TRUE(sphere.contains({3, 0, 0}));
    EXPECT_FALSE(sphere.contains({2.5, 1.5, 0}));
}

// An L on the ground y = 1, with up at -y: the notch is outside, and so is what lies below.
TEST(Region, polygon_holds_what_stands_on_it) {
    const Region r = region("polygon:-0.5,2,0,1,0,4,1,0,4,1,1,1,1,1,1,1,4,0,1,4");
    EXPECT_TRUE(r.contains({0.5, 0, 3}));
    EXPECT_TRUE(r.contains({3, 0, 0.5}));
    EXPECT_FALSE(r.contains({3, 0, 3})) << "the notch";
    EXPECT_FALSE(r.contains({-0.1, 0, 1}));
    EXPECT_TRUE(r.contains({0.5, -0.99, 0.5})) << "1.99 above the ground";
    EXPECT_FALSE(r.contains({0.5, -1.01, 0.5}));
    EXPECT_TRUE(r.contains({0.5, 1.49, 0.5}));
    EXPECT_FALSE(r.contains({0.5, 1.51, 0.5}));
    // The same corners the other way round hold the same.
    const Region turned = region("polygon:-0.5,2,0,1,4,1,1,4,1,1,1,4,1,1,4,1,0,0,1,0");
    EXPECT_TRUE(turned.contains({0.5, -0.99, 0.5}));
    EXPECT_FALSE(turned.contains({0.5, 1.51, 0.5}));
    EXPECT_FALSE(turned.contains({3, 0, 3}));
}

TEST(Region, splats_outside_are_counted_in_world_units) {
    SplatModel m;
    append_splat({1, 0, 0}, glm::dvec3(0.1), 0, m);
    append_splat({-1, 0, 0}, glm::dvec3(0.1), 0, m);
    m.origin = {100, 0, 0};
    EXPECT_EQ(splats_outside(region("sphere:101,0,0,0.5"), m), (std::vector<std::uint8_t>{0, 1}));
}

TEST(Region, text_repeats_every_region) {
    EXPECT_EQ(region_text(region("sphere:0.1,2,-3,4")), "sphere:0.1,2,-3,4");
    EXPECT_EQ(region_text(region("box:0,-1,2,1,1,3")), "box:0,-1,2,1,1,3");
    const std::string polygon = region_text(region("polygon:0,2,0,1,0,4,1,0,0,1,4"));
    EXPECT_TRUE(polygon.starts_with("polygon:0,2,0,1,0,4,1,0,")) << polygon;
}

TEST(Region, what_is_no_region_says_what_is) {
    EXPECT_NE(refusal_of("cube:1").find("polygon:LOW,HIGH"), std::string::npos);
    EXPECT_NE(refusal_of("box:1,1,1,0,2,2").find("holds nothing"), std::string::npos);
    EXPECT_NE(refusal_of("sphere:0,0,0").find("not 4 numbers"), std::string::npos);
    EXPECT_NE(refusal_of("subject:0").find("holds nothing"), std::string::npos);
    EXPECT_NE(refusal_of("polygon:0,1,0,0,0,1,0,0").find("three corners"), std::string::npos);
    EXPECT_NE(refusal_of("polygon:1,0,0,0,0,1,0,0,0,0,1").find("holds nothing"), std::string::npos);
    EXPECT_NE(refusal_of("polygon:0,1,0,0,0,1,0,0,2,0,0").find("one line"), std::string::npos);
    EXPECT_NE(refusal_of("polygon:0,1,0,0,0,1,0,0,0,1,0").find("upright"), std::string::npos);
    EXPECT_THROW(check_region("--roi", "polygon:"), Error);
    EXPECT_NO_THROW(check_region("--roi", "subject"));
}

}  // namespace
}  // namespace darb::test
