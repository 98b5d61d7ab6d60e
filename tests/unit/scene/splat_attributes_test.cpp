// SPDX-License-Identifier: MIT
// The table of splat attributes: its rows fit together, files carry every row, and code that only
// passes attributes on names none of them, so that adding one takes a row, its shader code and its
// reference.
#include "engine/scene/splat_model.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <regex>
#include <set>
#include <string>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/ply.h"

namespace darb {
namespace {

/// 3 splats in which every float is a different number.
SplatModel counted(int sh_degree) {
    SplatModel model;
    model.sh_degree = sh_degree;
    model.kernel = KERNEL_BETA;  // which takes every attribute
    float next = 0.25f;
    for (int a = 0; a < kAttributeCount; ++a) {
        attribute_values(model, a).resize(3 * attribute_floats(a, sh_degree));
        for (float& value : attribute_values(model, a)) value = next++;
    }
    return model;
}

TEST(SplatAttributes, every_row_has_an_array_and_names_of_its_own) {
    SplatModel model;
    std::set<const void*> arrays;
    std::set<std::string> names;
    for (int a = 0; a < kAttributeCount; ++a) {
        arrays.insert(&attribute_values(model, a));
        names.insert(attribute_name(a));
        names.insert(fmt::format("file {}", kSplatAttributes[static_cast<size_t>(a)].file_name));
    }
    EXPECT_EQ(arrays.size(), size_t{kAttributeCount});
    EXPECT_EQ(names.size(), 2 * size_t{kAttributeCount});
    auto order = attributes_in_file_order();
    EXPECT_EQ(order[0], kPosition) << "normals follow it";
    std::sort(order.begin(), order.end());
    for (int a = 0; a < kAttributeCount; ++a) EXPECT_EQ(order[static_cast<size_t>(a)], a);
}

TEST(SplatAttributes, floats_are_those_of_3dgs) {
    for (int degree = 0; degree <= 3; ++degree) {
        EXPECT_EQ(attribute_floats(kShRest, degree), 3u * ((degree + 1) * (degree + 1) - 1));
        EXPECT_EQ(splat_floats(degree), 14 + attribute_floats(kShRest, degree));
    }
}

TEST(SplatAttributes, columns_of_harmonics_go_by_channel) {
    std::set<size_t> columns;
    for (size_t c = 0; c < 24; ++c) {
        columns.insert(file_column(kShRest, 2, c));
        EXPECT_EQ(file_column(kShRest, 2, c), c % 3 * 8 + c / 3);
    }
    EXPECT_EQ(columns.size(), 24u);
    EXPECT_EQ(file_column(kRotation, 2, 3), 3u);
    EXPECT_EQ(ply_column(kPosition, 2), "z");
    EXPECT_EQ(ply_column(kRotation, 3), "rot_3");
    EXPECT_EQ(ply_column(kShRest, 23), "f_rest_23");
}

TEST(SplatAttributes, files_and_choices_carry_every_row) {
    for (int degree = 0; degree <= 3; ++degree) {
        const SplatModel model = counted(degree);
        const SplatModel read = parse_ply(encode_ply(model), "memory");
        const SplatModel turned = pick_splats(model, {2, 0});
        for (int a = 0; a < kAttributeCount; ++a) {
            const std::vector<float>& values = attribute_values(model, a);
            EXPECT_EQ(attribute_values(read, a), values) << attribute_name(a);
            const size_t floats = attribute_floats(a, degree);
            std::vector<float> expected(values.end() - static_cast<std::ptrdiff_t>(floats),
                                        values.end());
            expected.insert(expected.end(), values.begin(),
                            values.begin() + static_cast<std::ptrdiff_t>(floats));
            EXPECT_EQ(attribute_values(turned, a), expected) << attribute_name(a);
        }
    }
}

TEST(SplatAttributes, arrays_that_do_not_fit_are_named) {
    for (int a = 0; a < kAttributeCount; ++a) {
        if (a == kOpacityLogit) continue;  // it says how many splats there are
        SplatModel model = counted(1);
        attribute_values(model, a).pop_back();
        try {
            check_splat_shapes(model);
            FAIL() << attribute_name(a);
        } catch (const Error& error) {
            EXPECT_NE(std::string(error.what()).find(attribute_name(a)), std::string::npos);
        }
    }
}

}  // namespace
}  // namespace darb
