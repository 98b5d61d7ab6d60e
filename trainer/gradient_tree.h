// GradientTree: the gradients of a batch's views, added by a binary tree over the views' places in
// it: ((0 + 1) + (2 + 3)) + ((4 + 5) + (6 + 7)). The order depends on nothing else, so that any
// split of a batch into aligned subtrees ends with the same bits.
#pragma once

#include <vector>

#include "engine/raster/gradient_buffers.h"

namespace darb {

class GradientTree {
  public:
    /// Of batches of so many views at most, a power of two.
    GradientTree(Device& device, int batch);

    /// Device memory of a tree of so many views, with the buffers of reserve().
    static std::uint64_t device_bytes(std::uint64_t splats, int sh_degree, int kernel, int batch);
    /// Buffers for these splats; where they change, what they held is gone. The queue must be idle.
    void reserve(const GpuSplats& splats);

    /// Begins a batch, of no view.
    void begin() { views_ = held_ = 0; }
    /// Where the next view leaves its gradients.
    GradientBuffers& leaf() { return nodes_[static_cast<std::size_t>(held_)]; }
    /// That view is there: adds what now has its pair.
    void record_view(Commands& commands);
    /// No view follows: adds what is left, whose pair has no view, in the order of the tree.
    void record_end(Commands& commands);
    /// Of all views, after record_end; another process's, too, once it is added.
    GradientBuffers& sum() { return nodes_.front(); }
    /// Room for the sum of other views, to be added to that of these.
    GradientBuffers& other() { return nodes_[1]; }

  private:
    void record_pair(Commands& commands);

    Device* device_;
    std::vector<GradientBuffers> nodes_;  // sums of complete subtrees, the largest first, a leaf
    int views_ = 0, held_ = 0;            // so far; nodes that hold something
};

}  // namespace darb
