// SPDX-License-Identifier: MIT
// Palettes for many rows of numbers: k rows that stand for all of them, such that the sum of
// squared distances is small. The rows are cut into leaves of equal size by medians (a k-d tree).
// Each leaf gets centres in proportion to its error, and ten rounds of k-means (Lloyd 1982). For
// 700,000 rows this takes a hundredth of the work of one k-means over all rows. Also codebooks: 256
// numbers that stand for many.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace darb {

/// Rows [first_row, first_row + rows) choose among the centres [first_centre, first_centre +
/// centres).
struct ClusterBatch {
    std::uint32_t first_row = 0, rows = 0, first_centre = 0, centres = 0;
};

/// Sets labels[i] to the centre nearest to row i among those of its batch, the first of equals.
/// rows: [N][dims]; centres: [k][dims]; batches: in the order of their rows, all of which they
/// cover.
using AssignRows = std::function<void(
    const std::vector<float>& rows, std::size_t dims, const std::vector<float>& centres,
    const std::vector<ClusterBatch>& batches, std::vector<std::uint32_t>& labels)>;

/// AssignRows on the host.
void assign_rows(const std::vector<float>& rows, std::size_t dims,
                 const std::vector<float>& centres, const std::vector<ClusterBatch>& batches,
                 std::vector<std::uint32_t>& labels);

struct Clusters {
    std::vector<float> centres;        // [at most k][dims]
    std::vector<std::uint32_t> label;  // [N]
};

/// Called with the share of the work that is done, rising to 1.
using ClusterProgress = std::function<void(double)>;

/// rows: [N][dims], finite; k >= 1. Equal rows give equal clusters, provided that `assign` is
/// deterministic. With as many centres as rows, every row is a centre.
Clusters cluster_rows(const std::vector<float>& rows, std::size_t dims, std::size_t k,
                      const AssignRows& assign = assign_rows, const ClusterProgress& progress = {});

/// 256 numbers, ascending.
using Codebook256 = std::array<float, 256>;
/// Made by k-means in one dimension, starting from numbers that are dense where the values are.
/// values: finite. All zeros where there are none.
Codebook256 codebook_of(std::span<const float> values);
/// The entry nearest to value.
std::uint8_t nearest_entry(const Codebook256& book, float value);

}  // namespace darb
