// SPDX-License-Identifier: MIT
#include "engine/publish/page_splats.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "engine/scene/edit_splats.h"
#include "engine/scene/inflate.h"
#include "tests/support/splat_files.h"

namespace darb {
namespace {

TEST(PageSplats, exact_keeps_every_bit_and_the_order) {
    const SplatModel model = test::sample_model(3, 300);
    const PageSplats packed = pack_page_splats(model, page_precision(kPageLevels, KERNEL_GAUSSIAN));
    const SplatModel back = unpack_page_splats(packed, model);
    ASSERT_EQ(packed.count, 300u);
    EXPECT_EQ(packed.planes.size(), 300u * 59 * 4);
    for (int a = 0; a < kAttributeCount; ++a)
        EXPECT_EQ(attribute_values(back, a), attribute_values(model, a)) << attribute_name(a);
}

TEST(PageSplats, rounded_values_are_within_half_a_step) {
    const SplatModel model = test::sample_model(2, 500);
    for (int level = 0; level < kPageLevels; ++level) {
        const PagePrecision p = page_precision(level, KERNEL_GAUSSIAN);
        const PageSplats packed = pack_page_splats(model, p);
        const SplatModel back = unpack_page_splats(packed, model);
        ASSERT_EQ(back.size(), model.size());
        double step = 0;
        for (const PageColumn& column : packed.columns)
            if (column.attribute == kPosition) step = std::max(step, column.step);
        // Splats come in another order: each has its nearest.
        for (std::size_t i = 0; i < model.size(); ++i) {
            std::size_t nearest = 0;
            double least = 1e300;
            for (std::size_t j = 0; j < back.size(); ++j) {
                const double d = glm::length(position_of(model, i) - position_of(back, j));
                if (d < least) nearest = j;
                least = std::min(least, d);
            }
            ASSERT_LE(least, step) << "level " << level << " splat " << i;
            for (std::size_t k = 0; k < 3; ++k) {
                EXPECT_NEAR(back.log_scale[3 * nearest + k], model.log_scale[3 * i + k],
                            0.501 * p.log_scale);
                EXPECT_NEAR(back.sh_dc[3 * nearest + k], model.sh_dc[3 * i + k],
                            0.501 * p.colour / 0.282);
            }
            EXPECT_NEAR(sigmoid(back.opacity_logit[nearest]), sigmoid(model.opacity_logit[i]),
                        0.501 * p.opacity);
        }
    }
}

TEST(PageSplats, outlines_of_kernels_that_end_with_a_jump_are_finer) {
    const PagePrecision smooth = page_precision(1, KERNEL_RAISED_COSINE),
                        jumps = page_precision(1, KERNEL_INVERSE_QUADRATIC);
    EXPECT_LE(10 * jumps.log_scale, 1.001 * smooth.log_scale);
    EXPECT_LE(5 * jumps.rotation, 1.001 * smooth.rotation);
    EXPECT_EQ(jumps.harmonics, smooth.harmonics);
    EXPECT_EQ(jumps.position, smooth.position);
}

TEST(PageSplats, shapes_are_kept) {
    SplatModel model = test::sample_model(1, 40);
    set_kernel(model, KERNEL_BETA);
    for (std::size_t i = 0; i < model.size(); ++i) model.shape[i] = 0.05f * static_cast<float>(i);
    for (const int level : {0, kPageLevels}) {
        const SplatModel back =
            unpack_page_splats(pack_page_splats(model, page_precision(level, model.kernel)), model);
        ASSERT_EQ(back.shape.size(), back.size());
        std::vector<float> sorted = back.shape;
        std::ranges::sort(sorted);
        for (const float shape : sorted) {
            const float nearest = 0.05f * std::round(shape / 0.05f);
            EXPECT_NEAR(shape, nearest, level == 0 ? 0.5 / 128 + 1e-6 : 1e-6);
        }
    }
}

TEST(PageSplats, columns_fill_words_and_do_not_overlap) {
    for (const int level : {0, kPageLevels}) {
        const PageSplats packed =
            pack_page_splats(test::sample_model(3, 100), page_precision(level, KERNEL_GAUSSIAN));
        std::vector<std::uint32_t> taken(static_cast<std::size_t>(packed.words));
        for (const PageColumn& c : packed.columns) {
            const bool whole = c.attribute == kPosition || c.bits == 32;
            const std::uint32_t mask = whole ? ~0u : ((1u << c.bits) - 1) << c.shift;
            ASSERT_LT(c.word, packed.words);
            ASSERT_LE(c.shift + (whole ? 32 : c.bits), 32);
            EXPECT_EQ(taken[static_cast<std::size_t>(c.word)] & mask, 0u);
            taken[static_cast<std::size_t>(c.word)] |= mask;
        }
        EXPECT_LE(packed.words, level == 0 ? 20 : 37) << "a splat takes more memory than before";
    }
}

TEST(PageSplats, what_is_never_drawn_is_left_out) {
    SplatModel model = test::sample_model(0, 10);
    for (float& logit : model.opacity_logit) logit = 1;
    model.opacity_logit[1] = -9;
    model.position[3 * 2] = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t k = 0; k < 4; ++k) model.rotation[4 * 3 + k] = 0;
    for (const int level : {0, kPageLevels})
        EXPECT_EQ(pack_page_splats(model, page_precision(level, KERNEL_GAUSSIAN)).count, 7u);
}

TEST(PageSplats, far_splats_and_equal_ones_survive) {
    SplatModel model = test::sample_model(0, 64);
    for (float& logit : model.opacity_logit) logit = 2;
    for (float& v : model.position) v = 0.25f;
    model.position[0] = 1e30f;
    const SplatModel back =
        unpack_page_splats(pack_page_splats(model, page_precision(0, KERNEL_GAUSSIAN)), model);
    ASSERT_EQ(back.size(), 64u);
    for (const float v : back.position) EXPECT_TRUE(std::isfinite(v));
}

TEST(PageSplats, no_splats_are_no_bytes) {
    const PageSplats packed = pack_page_splats(SplatModel{}, page_precision(0, KERNEL_GAUSSIAN));
    EXPECT_EQ(packed.count, 0u);
    EXPECT_TRUE(packed.planes.empty());
}

}  // namespace
}  // namespace darb
