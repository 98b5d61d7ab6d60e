#include "trainer/gradient_tree.h"

#include <bit>

namespace darb {

namespace {

// A subtree of each size below the whole, and the leaf that completes them.
std::size_t nodes_of(int batch) {
    return static_cast<std::size_t>(std::bit_width(static_cast<unsigned>(batch)));
}

}  // namespace

GradientTree::GradientTree(Device& device, int batch) : device_(&device), nodes_(nodes_of(batch)) {}

std::uint64_t GradientTree::device_bytes(std::uint64_t splats, int sh_degree, int kernel,
                                         int batch) {
    return nodes_of(batch) * GradientBuffers::device_bytes(splats, sh_degree, kernel);
}

void GradientTree::reserve(const GpuSplats& splats) {
    if (nodes_.front().is_of(splats)) return;
    for (GradientBuffers& node : nodes_) node = {};  // first, so that there are never two trees
    for (GradientBuffers& node : nodes_) node = GradientBuffers(*device_, splats);
}

void GradientTree::record_pair(Commands& commands) {
    --held_;
    const auto from = static_cast<std::size_t>(held_);
    nodes_[from - 1].record_add(commands, nodes_[from]);
}

void GradientTree::record_view(Commands& commands) {
    ++views_;
    ++held_;
    while (held_ > std::popcount(static_cast<unsigned>(views_))) record_pair(commands);
}

void GradientTree::record_end(Commands& commands) {
    while (held_ > 1) record_pair(commands);
}

}  // namespace darb
