// SPDX-License-Identifier: MIT
// Sends finished runs of a comparison from one rank to another.
#pragma once

#include <span>
#include <vector>

#include "engine/ranks/ranks.h"
#include "tools/paper/compare_runs.h"

namespace darb {

/// Every field, including infinite and missing numbers; can be read only by the same version of
/// darb.
Bytes bytes_of_runs(const std::vector<ComparedRun>& runs);
std::vector<ComparedRun> runs_of_bytes(std::span<const std::byte> bytes);

/// The runs of all ranks in the order of their items: see turn_of. Where a rank ended early, its
/// later items are missing.
std::vector<ComparedRun> runs_of_all(Ranks& ranks, const std::vector<ComparedRun>& own,
                                     std::size_t items);

}  // namespace darb
