// SPDX-License-Identifier: MIT
// RankGroup: the ranks of a training run, and what they agree on: that they train the same, when to
// stop, that their splats are equal.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/ranks/ranks.h"
#include "engine/raster/gpu_splats.h"

namespace darb {

struct RankGroup {
    Ranks* all = nullptr;
    /// Whether their devices may round differently. Then equal bits are not promised; instead all
    /// take over the first one's splats, after each round of density control and in between.
    bool mixed = false;

    bool several() const { return all && all->count() > 1; }
};

/// Throws Error where the batch has no aligned parts of equal size for so many ranks.
void check_batch(const Ranks& ranks, int batch);

/// Facts about a rank's run, by name.
using RankFacts = std::vector<std::pair<std::string, std::string>>;
/// This program and build; with a device, also what decides how it rounds.
RankFacts rank_facts();
RankFacts rank_facts(const Device& device);
/// A number that stands for a text or an array in facts.
std::string fact_of(std::span<const std::byte> bytes);
/// Throws Error that names each rank whose facts differ from the first one's, and these facts. All
/// ranks call it with facts of the same names.
void check_same(Ranks& ranks, const RankFacts& facts);

/// Whether any rank is to stop. All ranks call it.
bool any_stops(Ranks& ranks, bool stop);

/// Throws Error that names the ranks whose splats differ from the first one's in any bit. The queue
/// must be idle; all ranks call it.
void check_equal_splats(Ranks& ranks, const GpuSplats& splats, int iteration);

}  // namespace darb
