#include "trainer/batch_step.h"

#include <algorithm>
#include <cstring>

namespace darb {

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

// Of all views, in order, those of the other ranks as they tell them.
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

}  // namespace darb
