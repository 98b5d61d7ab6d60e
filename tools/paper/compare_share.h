// Finished runs on their way from one rank to another.
#pragma once

#include <vector>

#include "engine/ranks/ranks.h"
#include "tools/paper/compare_runs.h"

namespace darb {

/// Every field, infinite and missing numbers among them; of this version of darb alone.
Bytes bytes_of_runs(const std::vector<ComparedRun>& runs);
std::vector<ComparedRun> runs_of_bytes(std::span<const std::byte> bytes);

/// What all ranks did, in the order of the items: see turn_of. Where one ended early, its later
/// items are left out.
std::vector<ComparedRun> runs_of_all(Ranks& ranks, const std::vector<ComparedRun>& own,
                                     std::size_t items);

}  // namespace darb
