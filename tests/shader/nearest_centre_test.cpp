// SPDX-License-Identifier: MIT
// The search for the nearest centre on the device, against the host's.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/core/rng.h"
#include "engine/publish/device_clusters.h"
#include "tests/support/shared_device.h"

namespace darb::test {
namespace {

std::vector<float> uniform_rows(size_t count, size_t dims, std::uint64_t seed) {
    Pcg32 rng(seed);
    std::vector<float> rows(count * dims);
    for (float& value : rows) value = static_cast<float>(2 * rng.uniform() - 1);
    return rows;
}

double distance(const std::vector<float>& rows, size_t i, const std::vector<float>& centres,
                size_t c, size_t dims) {
    double sum = 0;
    for (size_t d = 0; d < dims; ++d)
        sum += std::pow(double{rows[i * dims + d]} - centres[c * dims + d], 2);
    return sum;
}

TEST(NearestCentre, device_and_host_find_the_same) {
    for (const size_t dims : {9, 24, 45}) {
        const std::vector<float> rows = uniform_rows(333, dims, 1),
                                 centres = uniform_rows(77, dims, 2);
        const std::vector<ClusterBatch> batches = {
            {0, 1, 0, 1}, {1, 200, 1, 40}, {201, 132, 41, 36}};
        std::vector<std::uint32_t> host, device;
        assign_rows(rows, dims, centres, batches, host);
        DeviceClusters clusters(shared_device());
        clusters.assign(rows, dims, centres, batches, device);
        ASSERT_EQ(device.size(), 333u);
        for (size_t i = 0; i < 333; ++i)
            if (device[i] != host[i]) {  // at equal distance, up to rounding
                EXPECT_NEAR(distance(rows, i, centres, device[i], dims),
                            distance(rows, i, centres, host[i], dims), 1e-5)
                    << "dims " << dims << " row " << i;
            }
    }
}

// 32 MiB at a time: more rows than that come in parts.
TEST(NearestCentre, rows_beyond_a_part_are_found_too) {
    constexpr size_t kRows = 400'000, kDims = 24;
    std::vector<float> rows(kRows * kDims, 0.0f), centres(2 * kDims, 0.0f);
    centres[kDims] = 1;
    for (size_t i = 0; i < kRows; i += 3) rows[i * kDims] = 0.9f;
    std::vector<ClusterBatch> batches;
    for (std::uint32_t i = 0; i < kRows; i += 1000) batches.push_back({i, 1000, 0, 2});
    std::vector<std::uint32_t> labels;
    DeviceClusters(shared_device()).assign(rows, kDims, centres, batches, labels);
    for (size_t i = 0; i < kRows; ++i) ASSERT_EQ(labels[i], i % 3 == 0 ? 1u : 0u) << i;
}

TEST(NearestCentre, clusters_of_the_device_repeat) {
    const std::vector<float> rows = uniform_rows(5000, 9, 7);
    DeviceClusters clusters(shared_device());
    const AssignRows on_device =
        [&](const std::vector<float>& r, std::size_t dims, const std::vector<float>& centres,
            const std::vector<ClusterBatch>& batches, std::vector<std::uint32_t>& labels) {
            clusters.assign(r, dims, centres, batches, labels);
        };
    const Clusters a = cluster_rows(rows, 9, 300, on_device),
                   b = cluster_rows(rows, 9, 300, on_device);
    EXPECT_EQ(a.centres, b.centres);
    EXPECT_EQ(a.label, b.label);
}

}  // namespace
}  // namespace darb::test
