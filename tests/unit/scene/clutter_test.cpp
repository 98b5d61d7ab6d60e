// SPDX-License-Identifier: MIT
// Parts of a scene and haze, with shells whose parts are known.
#include "engine/scene/clutter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "engine/core/rng.h"
#include "tests/support/splat_files.h"

namespace darb::test {
namespace {

void put_shell(const glm::dvec3& centre, double radius, int count, SplatModel& m) {
    Pcg32 rng(static_cast<std::uint64_t>(count));
    for (int i = 0; i < count; ++i) {
        const glm::dvec3 way(rng.normal(), rng.normal(), rng.normal());
        append_splat(centre + radius * glm::normalize(way),
                     glm::dvec3(2 * radius / std::sqrt(count)), 3, m);
    }
}

std::size_t parts_among(const SplatParts& parts, std::size_t first, std::size_t end) {
    return std::set<std::uint32_t>(parts.part.begin() + static_cast<std::ptrdiff_t>(first),
                                   parts.part.begin() + static_cast<std::ptrdiff_t>(end))
        .size();
}

TEST(Clutter, parts_hold_what_touches) {
    SplatModel m;
    put_shell({0, 0, 0}, 1, 2000, m);
    const std::size_t second = m.size();
    put_shell({4, 0, 0}, 1, 500, m);
    const std::size_t bridge = m.size();
    EXPECT_EQ(parts_among(parts_of_splats(m), 0, second), 1u);
    EXPECT_EQ(parts_among(parts_of_splats(m), second, bridge), 1u);
    EXPECT_EQ(parts_among(parts_of_splats(m), 0, bridge), 2u);
    // A chain of thin needles along x joins both; one across it would not.
    SplatModel joined = m, crossed = m;
    for (double x = 1.2; x < 3; x += 0.4) {
        append_splat({x, 0, 0}, {0.15, 0.02, 0.02}, 3, joined);
        append_splat({x, 0, 0}, {0.02, 0.15, 0.02}, 3, crossed);
    }
    EXPECT_EQ(parts_among(parts_of_splats(joined), 0, joined.size()), 1u);
    EXPECT_EQ(parts_among(parts_of_splats(crossed), 0, bridge), 2u);
    // A splat as large as both lies over them, as a sky does, and joins nothing.
    SplatModel sky = m;
    append_splat({2, 0, 0}, glm::dvec3(6), 3, sky);
    EXPECT_EQ(parts_among(parts_of_splats(sky), 0, bridge), 2u);
}

// A small thing in the middle of a gap touches both sides, which are not among each other's nearest
// neighbours, nor is it among those of the crowd.
TEST(Clutter, parts_are_joined_beyond_the_nearest_neighbours) {
    SplatModel m;
    for (int i = 0; i < 3000; ++i) {
        const double angle = 0.01 * i;
        append_splat({0.05 * std::cos(angle), 0.05 * std::sin(angle), 0}, glm::dvec3(0.02), 3, m);
    }
    for (int i = 0; i < 40; ++i) append_splat({0.34 + 1e-4 * i, 0, 0}, glm::dvec3(0.01), 3, m);
    append_splat({0.2, 0, 0}, glm::dvec3(0.075), 3, m);
    EXPECT_EQ(parts_among(parts_of_splats(m), 0, m.size()), 1u);
}

TEST(Clutter, isolated_parts_are_the_light_ones) {
    SplatModel m;
    put_shell({0, 0, 0}, 1, 2000, m);
    const std::size_t thing = m.size();
    put_shell({5, 0, 0}, 0.5, 500, m);  // a quarter of the area
    const std::size_t floaters = m.size();
    for (int i = 0; i < 20; ++i) append_splat({0, 2 + 0.5 * i, 0}, glm::dvec3(0.03), 3, m);
    append_splat({0, 0, 1}, glm::dvec3(0.05), -30, m);  // never drawn
    m.rotation[4 * (m.size() - 2)] = 0;                 // nor is this
    const SplatSet set = isolated_splats(m, 0.01);
    for (std::size_t i = 0; i < m.size(); ++i) EXPECT_EQ(set[i], i >= floaters ? 1 : 0) << i;
    const SplatSet larger = isolated_splats(m, 0.5);
    for (std::size_t i = 0; i < m.size(); ++i) EXPECT_EQ(larger[i], i >= thing ? 1 : 0) << i;
    EXPECT_EQ(count_of(isolated_splats(m, 0)), 0u);
    EXPECT_TRUE(isolated_splats(SplatModel(), 0.5).empty());
}

TEST(Clutter, haze_is_large_and_faint) {
    SplatModel m;
    for (int i = 0; i < 9; ++i) append_splat({i, 0, 0}, glm::dvec3(0.1), 3, m);
    append_splat({0, 1, 0}, {0.1, 0.9, 0.1}, -3, m);  // opacity 0.047
    append_splat({0, 2, 0}, {0.1, 0.9, 0.1}, 0, m);   // opacity 0.5
    append_splat({0, 3, 0}, glm::dvec3(0.1), -3, m);
    const SplatSet set = hazy_splats(m, 0.1, 5);
    for (std::size_t i = 0; i < m.size(); ++i) EXPECT_EQ(set[i], i == 9 ? 1 : 0) << i;
    EXPECT_EQ(count_of(hazy_splats(m, 0.1, 10)), 0u);
    EXPECT_EQ(count_of(hazy_splats(m, 1, 0)), m.size());
    const std::vector<double> sizes = largest_deviations(m);
    EXPECT_NEAR(sizes[9], 0.9, 1e-6);
}

}  // namespace
}  // namespace darb::test
