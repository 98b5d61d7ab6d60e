// SPDX-License-Identifier: MIT
// The mean of the splats over iterations: compared with one in double, and what it holds and
// returns.
#include "trainer/step/optimizer.h"

#include <gtest/gtest.h>

#include "tests/support/shared_device.h"
#include "tests/support/test_scene.h"

namespace darb::test {
namespace {

SplatModel model(size_t count, int sh_degree, std::uint64_t seed) {
    return random_scene({.count = count, .sh_degree = sh_degree, .seed = seed}).model;
}

TEST(IterateAverage, is_that_in_double) {
    constexpr int kIterates = 12;
    for (const int sh_degree : {0, 1, 3}) {
        const size_t count = 333;
        IterateAverage average(shared_device());
        SplatModel last;
        std::vector<std::vector<double>> sum(kAttributeCount);
        for (int k = 1; k <= kIterates; ++k) {
            last = model(count, sh_degree, static_cast<std::uint64_t>(k));
            average.add(GpuSplats(shared_device(), last, true));
            for (int a = 0; a < kAttributeCount; ++a) {
                const std::vector<float>& values = attribute_values(last, a);
                sum[a].resize(values.size());
                for (size_t i = 0; i < values.size(); ++i) sum[a][i] += double(values[i]);
            }
        }
        EXPECT_EQ(average.count(), 12U);
        GpuSplats splats(shared_device(), last, true);
        average.swap(splats);
        const SplatModel mean = splats.download();
        for (int a = 0; a < kAttributeCount; ++a)
            for (size_t i = 0; i < sum[a].size(); ++i)
                ASSERT_NEAR(attribute_values(mean, a)[i], sum[a][i] / kIterates, 4e-6)
                    << attribute_name(a) << " " << i << ", degree " << sh_degree;
        average.swap(splats);
        EXPECT_EQ(splats.download().position, last.position);
        EXPECT_EQ(splats.download().sh_rest, last.sh_rest);
    }
}

// Harmonics that one binding of lavapipe does not hold, by ranges.
TEST(IterateAverage, reaches_the_last_of_many_splats) {
    constexpr size_t kCount = 380'000;
    SplatModel one;
    one.sh_degree = 3;
    one.resize(kCount);
    SplatModel two = one;
    for (int a = 0; a < kAttributeCount; ++a) {
        std::vector<float>& values = attribute_values(two, a);
        for (size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i % 4096);
    }
    IterateAverage average(shared_device());
    average.add(GpuSplats(shared_device(), one, true));
    GpuSplats splats(shared_device(), two, true);
    average.add(splats);
    average.swap(splats);
    const SplatModel mean = splats.download();
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::vector<float>&first = attribute_values(one, a), &got = attribute_values(mean, a);
        for (size_t i = 0; i < got.size(); ++i)
            ASSERT_EQ(got[i], first[i] + 0.5f * (static_cast<float>(i % 4096) - first[i]))
                << attribute_name(a) << " " << i;
    }
}

TEST(IterateAverage, goes_on_from_what_it_held) {
    const GpuSplats one(shared_device(), model(50, 2, 1), true),
        two(shared_device(), model(50, 2, 2), true);
    IterateAverage whole(shared_device()), second(shared_device());
    EXPECT_TRUE(whole.state(one).empty());
    whole.add(one);
    second.restore(whole.state(one), whole.count(), one);
    whole.add(two);
    second.add(two);
    EXPECT_EQ(second.count(), 2U);
    EXPECT_EQ(second.state(two), whole.state(two));
}

TEST(IterateAverage, begins_anew_with_another_count_and_degree) {
    IterateAverage average(shared_device());
    average.add(GpuSplats(shared_device(), model(50, 2, 1), true));
    average.clear();
    GpuSplats splats(shared_device(), model(0, 3, 1), true);
    average.swap(splats);  // with no splats
    EXPECT_EQ(splats.count(), 0U);
    const SplatModel other = model(70, 3, 2);
    splats = GpuSplats(shared_device(), other, true);
    average.add(splats);
    average.swap(splats);
    EXPECT_EQ(splats.download().sh_rest, other.sh_rest);
    average.clear();
    EXPECT_EQ(average.count(), 0U);
    average.add(GpuSplats(shared_device(), model(0, 3, 1), true));  // no splats are no error
}

}  // namespace
}  // namespace darb::test
