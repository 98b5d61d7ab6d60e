// SPDX-License-Identifier: MIT
#include "trainer/step/batch_step.h"
#include "trainer/step/rank_group.h"

#include <fmt/format.h>
#include <algorithm>
#include <bit>
#include <cstring>

#include "engine/core/error.h"
#include "engine/raster/attribute_rows.h"

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

namespace {

// What a rank tells the others of a view that it did: a StepOutcome without its passes.
struct ViewReport {
    gpu::FrameStatus status;
    double loss = 0, mse = 0;
    std::int32_t iteration = 0;
    std::uint32_t pixels = 0, redone = 0, overflows = 0;
    CameraTotals camera{};
};

void add_times(const std::vector<PassTime>& passes, StepOutcome& outcome) {
    outcome.passes.insert(outcome.passes.end(), passes.begin(), passes.end());
}

/// The part of a batch that a rank has; none where the batch is short and ends before it.
struct Part {
    int begin, end;  // places
    bool empty() const { return begin >= end; }
};
Part part_of(int rank, int ranks, int each, int views) {
    return {std::min(rank * each, views), std::min((rank + ranks) * each, views)};
}

std::vector<StepOutcome> run_part(TrainingStep& step, GradientTree& tree,
                                  std::vector<StepInput>& views, const Part& part) {
    std::vector<StepOutcome> outcomes;
    tree.begin();
    for (int place = part.begin; place < part.end; ++place) {
        StepInput& view = views[static_cast<std::size_t>(place)];
        view.gradients = &tree.leaf();
        if (place + 1 < part.end)
            view.next_view =
                static_cast<int>(views[static_cast<std::size_t>(place) + 1].view.frame.index);
        StepOutcome outcome = step.run_view(view);
        add_times(step.work([&](Commands& commands) {
            tree.record_view(commands);
            if (place + 1 == part.end) tree.record_end(commands);
        }),
                  outcome);
        outcomes.push_back(std::move(outcome));
    }
    return outcomes;
}

// The outcomes of all views, in order; the other ranks report theirs.
std::vector<StepOutcome> outcomes_of_all(Ranks& ranks, std::vector<StepOutcome> own) {
    std::vector<ViewReport> reports;
    for (const StepOutcome& o : own)
        reports.push_back(
            {o.status, o.loss, o.mse, o.iteration, o.pixels, o.redone, o.overflows, o.camera});
    const std::vector<Bytes> told = ranks.gather(std::as_bytes(std::span(reports)));
    std::vector<StepOutcome> all;
    for (int r = 0; r < ranks.count(); ++r) {
        if (r == ranks.rank()) {
            std::move(own.begin(), own.end(), std::back_inserter(all));
            continue;
        }
        const Bytes& bytes = told[static_cast<std::size_t>(r)];
        std::vector<ViewReport> its(bytes.size() / sizeof(ViewReport));
        if (!its.empty()) std::memcpy(its.data(), bytes.data(), its.size() * sizeof(ViewReport));
        for (const ViewReport& v : its)
            all.push_back({v.iteration,
                           v.status,
                           v.loss,
                           v.mse,
                           v.pixels,
                           {},
                           v.redone,
                           v.overflows,
                           v.camera});
    }
    return all;
}

// Each rank has the gradients of the maps of its own views.
void share_exposures(TrainingStep& step, Ranks& ranks, const Part& part) {
    if (!step.exposure() || ranks.count() == 1) return;
    std::vector<float> own;
    for (int place = part.begin; place < part.end; ++place) {
        const std::vector<float> one = step.exposure()->gradient(place);
        own.insert(own.end(), one.begin(), one.end());
    }
    std::vector<float> all;
    for (const Bytes& bytes : ranks.gather(std::as_bytes(std::span(own)))) {
        const std::size_t before = all.size();
        all.resize(before + bytes.size() / sizeof(float));
        if (!bytes.empty()) std::memcpy(all.data() + before, bytes.data(), bytes.size());
    }
    const std::size_t each = step.exposure()->gradient_floats();
    for (std::size_t place = 0; place * each < all.size(); ++place)
        step.exposure()->set_gradient(
            static_cast<int>(place),
            {all.begin() + static_cast<std::ptrdiff_t>(place * each),
             all.begin() + static_cast<std::ptrdiff_t>((place + 1) * each)});
}

// Partners are neighbours first, then halves of four, and so on: the tree of the places goes on.
// Both add the same two sums; a sum does not depend on which of two numbers comes first.
void add_parts(TrainingStep& step, GradientTree& tree, Ranks& ranks, int each,
               const std::vector<StepInput>& views) {
    const int degree = views.back().view.frame.sh_degree;
    const auto count = static_cast<int>(views.size());
    for (int size = 1; size < ranks.count(); size *= 2) {
        const int partner = ranks.rank() ^ size;
        const bool own = !part_of(ranks.rank() / size * size, size, each, count).empty();
        const bool its = !part_of(partner / size * size, size, each, count).empty();
        if (!own && !its) continue;
        const Bytes got =
            ranks.exchange(partner, own ? packed_gradients(tree.sum(), degree) : Bytes{});
        if (!its) continue;
        unpack_gradients(got, degree, own ? tree.other() : tree.sum());
        if (own)
            step.work([&](Commands& commands) { tree.sum().record_add(commands, tree.other()); });
    }
}

}  // namespace

std::vector<StepOutcome> run_batch_step(TrainingStep& step, GradientTree& tree,
                                        const GpuSplats& splats, std::vector<StepInput>& views,
                                        Ranks& ranks, int batch) {
    const int each = batch / ranks.count();
    const Part part = part_of(ranks.rank(), 1, each, static_cast<int>(views.size()));
    step.drain();
    tree.reserve(splats);
    std::vector<StepOutcome> outcomes = outcomes_of_all(ranks, run_part(step, tree, views, part));
    share_exposures(step, ranks, part);
    add_parts(step, tree, ranks, each, views);
    for (StepOutcome& outcome : outcomes) outcome.ends_step = &outcome == &outcomes.back();
    add_times(step.run_update(views, tree.sum()), outcomes.back());
    return outcomes;
}

// Gradients on their way to another rank: rows of splats that a view showed.

namespace {

constexpr AttributeRows kPairs{2, 0};  // layout of views()

// Calls visit(buffer, its rows, floats in use) for each buffer of a splat's that travels.
template <class Gradients, class Visit>
void for_each_column(Gradients& gradients, int sh_degree, Visit visit) {
    visit(gradients.views(), kPairs, std::size_t{2});
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::size_t held = gradients.stride(a);
        const std::size_t floats =
            a == kShRest ? std::min<std::size_t>(attribute_floats(a, sh_degree), held) : held;
        if (floats > 0) visit(gradients.of(a), gradients.rows(a), floats);
    }
}

std::size_t mask_bytes(std::size_t splats) {
    return (splats + 7) / 8;
}

bool is_shown(std::span<const std::byte> mask, std::size_t splat) {
    return (mask[splat / 8] & std::byte(1 << splat % 8)) != std::byte{0};
}

}  // namespace

Bytes packed_gradients(const GradientBuffers& gradients, int sh_degree) {
    const std::size_t n = gradients.count();
    Bytes bytes(mask_bytes(n));
    if (n == 0) return bytes;
    const std::vector<float> views = download_rows(gradients.views(), kPairs, n);
    std::size_t shown = 0;
    for (std::size_t i = 0; i < n; ++i) {
        if (views[2 * i + 1] == 0) continue;
        bytes[i / 8] |= std::byte(1 << i % 8);
        ++shown;
    }
    for_each_column(gradients, sh_degree,
                    [&](const Buffer& buffer, const AttributeRows& rows, std::size_t floats) {
                        const std::vector<float> values = download_rows(buffer, rows, n);
                        std::size_t at = bytes.size();
                        bytes.resize(at + shown * floats * sizeof(float));
                        for (std::size_t i = 0; i < n; ++i) {
                            if (!is_shown(bytes, i)) continue;
                            std::memcpy(&bytes[at], &values[i * rows.floats],
                                        floats * sizeof(float));
                            at += floats * sizeof(float);
                        }
                    });
    return bytes;
}

void unpack_gradients(std::span<const std::byte> bytes, int sh_degree, GradientBuffers& to) {
    const std::size_t n = to.count();
    std::size_t shown = 0, floats_a_row = 0;
    if (bytes.size() >= mask_bytes(n))
        for (std::size_t i = 0; i < n; ++i) shown += is_shown(bytes, i) ? 1 : 0;
    for_each_column(to, sh_degree, [&](const Buffer&, const AttributeRows&, std::size_t floats) {
        floats_a_row += floats;
    });
    if (bytes.size() != mask_bytes(n) + shown * floats_a_row * sizeof(float))
        throw Error("gradients of another rank",
                    fmt::format("{} bytes for {} splats, {} of them shown", bytes.size(), n, shown),
                    "The ranks do not train the same splats: go on from the last checkpoint.");
    if (n == 0) return;
    std::size_t at = mask_bytes(n);
    for_each_column(
        to, sh_degree, [&](Buffer& buffer, const AttributeRows& rows, std::size_t floats) {
            std::vector<float> values(n * rows.floats, 0.0f);
            for (std::size_t i = 0; i < n; ++i) {
                if (!is_shown(bytes, i)) continue;
                std::memcpy(&values[i * rows.floats], &bytes[at], floats * sizeof(float));
                at += floats * sizeof(float);
            }
            upload_rows(buffer, rows, values);
        });
}

}  // namespace darb
