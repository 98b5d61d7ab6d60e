// SPDX-License-Identifier: MIT
// Splats in Morton order: against a stable sort on the host, with everything that belongs to a
// splat, and the resulting picture.
#include "trainer/growth/density_control.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "engine/render/renderer.h"
#include "tests/support/shared_device.h"
#include "tests/support/test_scene.h"

namespace darb::test {
namespace {

constexpr MortonGrid kGrid{{0.25f, 0, 0}, 3};

TestScene scene(size_t count) {
    return random_scene({.count = count,
                         .sh_degree = 1,
                         .min_log_scale = -4,
                         .max_log_scale = -2,
                         .min_logit = -1,
                         .max_logit = 3,
                         .seed = 17});
}

std::uint32_t cell(float position, float centre) {
    if (!std::isfinite(position)) return 1023;
    const float low = centre - kGrid.half_side;
    const float at = (position - low) * (1024 / (2 * kGrid.half_side));
    return static_cast<std::uint32_t>(std::clamp(at, 0.0f, 1023.0f));
}

std::uint32_t key_of(const SplatModel& model, size_t i) {
    std::uint32_t key = 0;
    for (int bit = 0; bit < 10; ++bit)
        for (int a = 0; a < 3; ++a)
            key |= (cell(model.position[3 * i + size_t(a)], kGrid.centre[a]) >> bit & 1)
                   << (3 * bit + a);
    return key;
}

std::vector<size_t> expected_order(const SplatModel& model) {
    std::vector<size_t> order(model.size());
    std::iota(order.begin(), order.end(), size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](size_t a, size_t b) { return key_of(model, a) < key_of(model, b); });
    return order;
}

std::vector<float> numbered(size_t count) {
    std::vector<float> values(count);
    std::iota(values.begin(), values.end(), 0.0f);
    return values;
}

void put_in_order(GpuSplats& splats) {
    DensityControl density(shared_device(), splats.kernel());
    MortonOrder(shared_device()).run(splats, density, kGrid);
}

TEST(MortonOrder, everything_of_a_splat_moves_as_a_stable_sort_says) {
    SplatModel model = scene(700).model;
    for (size_t i = 0; i < 40; ++i)  // equal cells: they keep their order
        for (size_t a = 0; a < 3; ++a) model.position[3 * (600 + i) + a] = model.position[a];
    model.position[3 * 5] = 1e6f;  // outside of the grid
    model.position[3 * 6 + 1] = std::numeric_limits<float>::quiet_NaN();
    GpuSplats splats(shared_device(), model, true, true);
    for (int a = 0; a < kAttributeCount; ++a)
        splats.upload_moments(a, numbered(model.size() * splats.stride(a) * 2));
    const size_t rest = splats.stride(kShRest);
    ASSERT_GT(rest, 0U);
    splats.upload_rest_sum(numbered(model.size() * rest));
    put_in_order(splats);
    ASSERT_EQ(splats.count(), model.size());
    const auto sums = splats.download_rest_sum();
    const SplatModel got = splats.download();
    const std::vector<size_t> order = expected_order(model);
    ASSERT_FALSE(std::is_sorted(order.begin(), order.end()));
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::vector<float>&before = attribute_values(model, a),
              &after = attribute_values(got, a);
        const size_t stride = splats.stride(a);
        const auto moments = splats.download_moments(a);
        for (size_t i = 0; i < order.size(); ++i)
            for (size_t c = 0; c < stride; ++c) {
                const float wanted = before[order[i] * stride + c], value = after[i * stride + c];
                ASSERT_TRUE(value == wanted || (std::isnan(value) && std::isnan(wanted)))
                    << attribute_name(a) << " of " << i << ": " << value << ", not " << wanted;
                ASSERT_EQ(moments[2 * (i * stride + c)],
                          static_cast<float>(2 * (order[i] * stride + c)));
                if (a == kShRest) {
                    ASSERT_EQ(sums[i * stride + c], static_cast<float>(order[i] * stride + c));
                }
            }
    }
}

TEST(MortonOrder, neighbours_on_the_curve_are_nearer_than_in_any_order) {
    const SplatModel model = scene(2'000).model;
    GpuSplats splats(shared_device(), model, true);
    put_in_order(splats);
    const auto mean_step = [](const SplatModel& m) {
        double sum = 0;
        for (size_t i = 1; i < m.size(); ++i) {
            glm::dvec3 step;
            for (int a = 0; a < 3; ++a)
                step[a] = m.position[3 * i + size_t(a)] - m.position[3 * i - 3 + size_t(a)];
            sum += glm::length(step);
        }
        return sum / static_cast<double>(m.size());
    };
    EXPECT_LT(mean_step(splats.download()), 0.4 * mean_step(model));
}

TEST(MortonOrder, a_picture_without_ties_keeps_every_bit) {
    const TestScene s = scene(400);
    GpuSplats splats(shared_device(), s.model, true);
    put_in_order(splats);
    const SplatModel moved = splats.download();
    ASSERT_NE(moved.position, s.model.position);
    Renderer before(shared_device(), s.model), after(shared_device(), moved);
    const ImageF a = before.render(s.camera), b = after.render(s.camera);
    EXPECT_GT(before.status().visible, 100U);
    EXPECT_EQ(a.data, b.data);
}

TEST(MortonOrder, none_and_one_are_left_alone) {
    for (const size_t count : {size_t{0}, size_t{1}}) {
        GpuSplats splats(shared_device(), scene(count).model, true);
        put_in_order(splats);
        EXPECT_EQ(splats.count(), count);
    }
}

}  // namespace
}  // namespace darb::test
