// SPDX-License-Identifier: MIT
// Where the floats of splats lie in a buffer of the device: what comes back is what went there, and
// neighbours in a block are neighbours in memory.
#include "engine/raster/attribute_rows.h"

#include <gtest/gtest.h>

#include <numeric>

#include "engine/scene/splat_model.h"

namespace darb {
namespace {

std::vector<float> numbers(std::size_t count) {
    std::vector<float> values(count);
    std::iota(values.begin(), values.end(), 1.0f);
    return values;
}

TEST(AttributeRows, what_is_held_gives_the_values_back) {
    for (int degree = 0; degree <= 3; ++degree)
        for (const std::size_t splats : {0u, 1u, 7u, 8u, 9u, 5000u})
            for (const std::uint32_t of_each : {1u, 2u})
                for (const int a : {int(kRotation), int(kShRest)}) {
                    const auto rows = attribute_rows(a, attribute_floats(a, degree), of_each);
                    const std::vector<float> values = numbers(splats * rows.floats);
                    const std::vector<float> held = held_rows(rows, values);
                    EXPECT_EQ(held.size() * sizeof(float), rows.bytes(splats));
                    EXPECT_EQ(values_of_rows(rows, held, splats), values)
                        << attribute_name(a) << " degree " << degree << ", " << splats
                        << " splats, " << of_each;
                }
}

TEST(AttributeRows, harmonics_lie_in_columns_of_a_block) {
    constexpr std::size_t kSplats = 11;
    const auto rows = attribute_rows(kShRest, attribute_floats(kShRest, 3));
    ASSERT_EQ(rows.columns, 12u);
    const std::vector<float> values = numbers(kSplats * rows.floats);
    const std::vector<float> held = held_rows(rows, values);
    ASSERT_EQ(held.size(), 2 * ROW_BLOCK * 48u);
    for (std::size_t splat = 0; splat < 2 * ROW_BLOCK; ++splat)
        for (std::size_t f = 0; f < 48; ++f) {
            const std::size_t block = splat / ROW_BLOCK, lane = splat % ROW_BLOCK;
            const float expected =
                splat < kSplats && f < rows.floats ? values[splat * rows.floats + f] : 0;
            EXPECT_EQ(held[((block * 12 + f / 4) * ROW_BLOCK + lane) * 4 + f % 4], expected)
                << "splat " << splat << " float " << f;
        }
}

TEST(AttributeRows, other_attributes_lie_row_by_row) {
    const auto rows = attribute_rows(kPosition, 3, 2);
    EXPECT_EQ(rows.columns, 0u);
    EXPECT_EQ(rows.bytes(5), 5 * 6 * sizeof(float));
    EXPECT_EQ(held_rows(rows, numbers(30)), numbers(30));
}

}  // namespace
}  // namespace darb
