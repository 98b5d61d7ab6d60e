// SPDX-License-Identifier: MIT
// The step of a batch: the views one after the other into a tree of gradients, then one step of the
// optimizer of their mean. Of several ranks each does its aligned part of the views; their sums are
// added in the same tree, by all of them, and all make the step.
#pragma once

#include <vector>

#include "engine/ranks/ranks.h"
#include "engine/raster/gradient_buffers.h"
#include "trainer/step/step.h"

namespace darb {

class GradientTree {
  public:
    /// For batches of at most `batch` views, a power of two.
    GradientTree(Device& device, int batch);

    /// Device memory of a tree of so many views, with the buffers of reserve().
    static std::uint64_t device_bytes(std::uint64_t splats, int sh_degree, int kernel, int batch);
    /// Buffers for these splats; where they change, what they held is gone. The queue must be idle.
    void reserve(const GpuSplats& splats);

    /// Begins a batch, with no view yet.
    void begin() { views_ = held_ = 0; }
    /// Where the next view leaves its gradients.
    GradientBuffers& leaf() { return nodes_[static_cast<std::size_t>(held_)]; }
    /// The next view's gradients are there: adds every pair that is now complete.
    void record_view(Commands& commands);
    /// No view follows: adds what is left without a partner, in the order of the tree.
    void record_end(Commands& commands);
    /// The sum over all views, after record_end; includes another process's views once they are
    /// added.
    GradientBuffers& sum() { return nodes_.front(); }
    /// Room for the sum of other views, to be added to that of these.
    GradientBuffers& other() { return nodes_[1]; }

  private:
    void record_pair(Commands& commands);

    Device* device_;
    std::vector<GradientBuffers> nodes_;  // sums of complete subtrees, the largest first, a leaf
    int views_ = 0, held_ = 0;            // views so far; nodes that hold something
};

/// views: in the order of their places, which their inputs name; fewer than the batch at the end of
/// a run. One outcome a view, in order, the same on all ranks but for the times of passes.
std::vector<StepOutcome> run_batch_step(TrainingStep& step, GradientTree& tree,
                                        const GpuSplats& splats, std::vector<StepInput>& views,
                                        Ranks& ranks, int batch);

/// One rank's gradients as bytes for another: which rows any of its views showed, a bit per splat,
/// and these rows, up to the degree of harmonics in use. The queue must be idle.
Bytes packed_gradients(const GradientBuffers& gradients, int sh_degree);
/// Puts such bytes back into buffers for as many splats; rows that are not there become 0. Throws
/// Error where the bytes are not such gradients.
void unpack_gradients(std::span<const std::byte> bytes, int sh_degree, GradientBuffers& to);

}  // namespace darb
