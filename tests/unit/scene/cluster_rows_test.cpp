// SPDX-License-Identifier: MIT
#include "engine/scene/cluster_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "engine/core/rng.h"

namespace darb::test {
namespace {

constexpr size_t kDims = 9;

/// Most rows are near 0 and some far off, like harmonics.
std::vector<float> sample_rows(size_t count, std::uint64_t seed = 1) {
    Pcg32 rng(seed);
    std::vector<float> rows;
    for (size_t i = 0; i < count; ++i) {
        const float width = rng.uniform() < 0.25 ? 1.0f : 0.05f;
        for (size_t d = 0; d < kDims; ++d)
            rows.push_back(width * static_cast<float>(2 * rng.uniform() - 1));
    }
    return rows;
}

double error_of_clusters(const std::vector<float>& rows, const Clusters& clusters) {
    double sum = 0;
    for (size_t i = 0; i < rows.size(); ++i) {
        const double off =
            double{rows[i]} - clusters.centres[clusters.label[i / kDims] * kDims + i % kDims];
        sum += off * off;
    }
    return sum;
}

/// Lloyd over all rows at once, from evenly spaced rows: what leaves are compared with.
Clusters plain_k_means(const std::vector<float>& rows, size_t k) {
    const size_t count = rows.size() / kDims;
    Clusters clusters;
    for (size_t c = 0; c < k; ++c)
        for (size_t d = 0; d < kDims; ++d)
            clusters.centres.push_back(rows[c * count / k * kDims + d]);
    for (int round = 0; round <= 10; ++round) {
        const ClusterBatch all{0, static_cast<std::uint32_t>(count), 0,
                               static_cast<std::uint32_t>(k)};
        assign_rows(rows, kDims, clusters.centres, {all}, clusters.label);
        if (round == 10) break;
        std::vector<double> sum(clusters.centres.size()), n(k);
        for (size_t i = 0; i < count; ++i) {
            ++n[clusters.label[i]];
            for (size_t d = 0; d < kDims; ++d)
                sum[clusters.label[i] * kDims + d] += rows[i * kDims + d];
        }
        for (size_t c = 0; c < clusters.centres.size(); ++c)
            if (n[c / kDims] > 0) clusters.centres[c] = static_cast<float>(sum[c] / n[c / kDims]);
    }
    return clusters;
}

TEST(ClusterRows, the_nearest_of_the_batch_is_found) {
    const std::vector<float> rows = sample_rows(100), centres = sample_rows(37, 2);
    std::vector<std::uint32_t> labels;
    assign_rows(rows, kDims, centres, {{0, 60, 3, 20}, {60, 40, 23, 14}}, labels);
    ASSERT_EQ(labels.size(), 100u);
    for (size_t i = 0; i < 100; ++i) {
        size_t nearest = 0;
        double least = 1e9;
        for (size_t c = i < 60 ? 3 : 23; c < (i < 60 ? 23u : 37u); ++c) {
            double sum = 0;
            for (size_t d = 0; d < kDims; ++d)
                sum += std::pow(double{rows[i * kDims + d]} - centres[c * kDims + d], 2);
            if (sum < least - 1e-6) {
                least = sum;
                nearest = c;
            }
        }
        EXPECT_EQ(labels[i], nearest) << i;
    }
}

TEST(ClusterRows, as_many_centres_as_rows_lose_nothing) {
    const std::vector<float> rows = sample_rows(500);
    EXPECT_LT(error_of_clusters(rows, cluster_rows(rows, kDims, 500)), 1e-9);
    EXPECT_LT(error_of_clusters(rows, cluster_rows(rows, kDims, 5000)), 1e-9);
}

TEST(ClusterRows, equal_rows_and_few_are_no_trouble) {
    const std::vector<float> equal(kDims * 9000, 0.25f);
    const Clusters clusters = cluster_rows(equal, kDims, 64);
    EXPECT_LE(clusters.centres.size() / kDims, 64u);
    EXPECT_LT(error_of_clusters(equal, clusters), 1e-9);
    EXPECT_TRUE(cluster_rows({}, kDims, 4).label.empty());
    EXPECT_EQ(cluster_rows(sample_rows(1), kDims, 4).label.size(), 1u);
}

// Two leaves of numbers without any order: the worst case for leaves.
TEST(ClusterRows, leaves_lose_little_against_plain_k_means) {
    const std::vector<float> rows = sample_rows(9000);
    const Clusters clusters = cluster_rows(rows, kDims, 450);
    EXPECT_LE(clusters.centres.size() / kDims, 450u);
    EXPECT_GE(clusters.centres.size() / kDims, 440u);
    const double ours = error_of_clusters(rows, clusters),
                 plain = error_of_clusters(rows, plain_k_means(rows, 450));
    RecordProperty("share_of_plain", std::to_string(ours / plain));
    EXPECT_LT(ours, 1.25 * plain);
}

// As in a small scene: more centres than half of the rows. The work must stay below that for a
// scene with many rows.
TEST(ClusterRows, many_centres_of_few_rows_are_near_and_cheap) {
    const std::vector<float> rows = sample_rows(9000);
    double work = 0;
    const AssignRows counting = [&](const auto& r, size_t dims, const auto& centres,
                                    const std::vector<ClusterBatch>& batches, auto& labels) {
        for (const ClusterBatch& batch : batches)
            work += double{1} * batch.rows * batch.centres / (9000.0 * 9000.0);
        assign_rows(r, dims, centres, batches, labels);
    };
    std::vector<double> shares;
    const Clusters clusters =
        cluster_rows(rows, kDims, 5000, counting, [&](double share) { shares.push_back(share); });
    EXPECT_LE(clusters.centres.size() / kDims, 5000u);
    EXPECT_LT(work, 1) << "products of all rows with all";
    const double ours = error_of_clusters(rows, clusters),
                 plain = error_of_clusters(rows, plain_k_means(rows, 5000));
    RecordProperty("share_of_plain", std::to_string(ours / plain));
    EXPECT_LT(ours, 1.25 * plain);
    ASSERT_FALSE(shares.empty());
    EXPECT_TRUE(std::ranges::is_sorted(shares));
    EXPECT_EQ(shares.back(), 1);
}

TEST(ClusterRows, the_same_rows_give_the_same_clusters) {
    const std::vector<float> rows = sample_rows(9000);
    const Clusters a = cluster_rows(rows, kDims, 300), b = cluster_rows(rows, kDims, 300);
    EXPECT_EQ(a.centres, b.centres);
    EXPECT_EQ(a.label, b.label);
}

TEST(ClusterRows, a_codebook_has_its_numbers_where_values_are) {
    std::vector<float> few = {-3, 7, 7, 0.5f, -3};
    const Codebook256 book = codebook_of(few);
    for (const float value : few) EXPECT_NEAR(book[nearest_entry(book, value)], value, 1e-6);
    EXPECT_TRUE(std::ranges::is_sorted(book));
    EXPECT_EQ(codebook_of({})[255], 0);
    EXPECT_EQ(codebook_of(std::vector<float>(9, 2.5f))[100], 2.5f);
    std::vector<float> normal;
    Pcg32 rng(5);
    for (int i = 0; i < 20000; ++i) {
        double sum = -6;
        for (int k = 0; k < 12; ++k) sum += rng.uniform();
        normal.push_back(static_cast<float>(sum));
    }
    const Codebook256 levels = codebook_of(normal);
    double square = 0;
    for (const float value : normal)
        square += std::pow(double{levels[nearest_entry(levels, value)]} - value, 2);
    // Panter and Dite: sqrt(3) pi / 2 / 256^2 of the variance for a normal density, 4.2e-5.
    EXPECT_LT(square / 20000, 6e-5) << square / 20000;
}

TEST(ClusterRows, the_nearest_entry_is_the_nearest) {
    Codebook256 book{};
    for (size_t i = 0; i < 256; ++i) book[i] = static_cast<float>(i * i);
    for (const float value : {-5.f, 0.f, 0.4f, 0.6f, 2.5f, 30.f, 65024.f, 65025.f, 1e9f}) {
        size_t best = 0;
        for (size_t i = 0; i < 256; ++i)
            if (std::abs(book[i] - value) < std::abs(book[best] - value)) best = i;
        EXPECT_EQ(nearest_entry(book, value), best) << value;
    }
}

}  // namespace
}  // namespace darb::test
