// A palette for many rows of numbers: k rows that stand for all, such that the sum of squared
// distances is small. The rows are cut into leaves of equal size by medians (a k-d tree); each leaf
// gets centres by its share of the error, and ten rounds of k-means (Lloyd 1982) within it. Against
// one k-means over all rows that is a hundredth of the work for 700,000 rows. And codebooks of 256
// numbers for many numbers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace darb {

/// Rows [first_row, first_row + rows) look among centres [first_centre, first_centre + centres).
struct ClusterBatch {
    std::uint32_t first_row = 0, rows = 0, first_centre = 0, centres = 0;
};

/// labels[i]: the centre nearest to row i of those of its batch, the first of several; rows
/// [N][dims], centres [k][dims], batches in order of their rows, which they cover.
using AssignRows = std::function<void(
    const std::vector<float>& rows, std::size_t dims, const std::vector<float>& centres,
    const std::vector<ClusterBatch>& batches, std::vector<std::uint32_t>& labels)>;

/// On the host.
void assign_rows(const std::vector<float>& rows, std::size_t dims,
                 const std::vector<float>& centres, const std::vector<ClusterBatch>& batches,
                 std::vector<std::uint32_t>& labels);

struct Clusters {
    std::vector<float> centres;        // [at most k][dims]
    std::vector<std::uint32_t> label;  // [N]
};

/// Called with the share that is done, rising to 1.
using ClusterProgress = std::function<void(double)>;

/// rows: [N][dims], finite; 1 <= k. The same rows give the same clusters, where assign does. With
/// as many centres as rows, each row is one.
Clusters cluster_rows(const std::vector<float>& rows, std::size_t dims, std::size_t k,
                      const AssignRows& assign = assign_rows, const ClusterProgress& progress = {});

/// 256 numbers, ascending.
using Codebook256 = std::array<float, 256>;
/// By k-means in one dimension, from numbers that lie dense where values do; finite values. Zeros
/// where there are none.
Codebook256 codebook_of(std::span<const float> values);
/// The entry nearest to value.
std::uint8_t nearest_entry(const Codebook256& book, float value);

}  // namespace darb
