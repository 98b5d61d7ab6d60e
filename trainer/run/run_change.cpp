// SPDX-License-Identifier: MIT
#include "trainer/run/run_change.h"
#include "engine/core/count_text.h"

#include <fmt/format.h>

namespace darb {

namespace {

std::string most_text(std::uint32_t splats) {
    return splats == kAnyNumberOfSplats ? "any number" : count_text(splats);
}

std::string memory_text(std::uint64_t bytes) {
    return bytes == 0 ? "what there is" : fmt::format("{:.0f} MiB", double(bytes) / 1024 / 1024);
}

}  // namespace

std::string change_refusal(const RunChange& change, const TrainOptions& options,
                           const ChangePlace& place) {
    if (place.several) return "A run of several ranks keeps its settings.";
    if (change.max_splats && *change.max_splats == 0) return "A run needs at least one splat.";
    if (const std::uint64_t bytes = change.max_memory_bytes.value_or(0);
        bytes > 0 && bytes < place.peak_bytes)
        return fmt::format("The run has needed {} of device memory already.",
                           memory_text(place.peak_bytes));
    if (!change.iterations || *change.iterations == options.iterations) return "";
    if (*change.iterations <= place.iteration)
        return fmt::format("Iteration {} is over: stop the run, or name more than {}.",
                           *change.iterations, place.iteration);
    if (place.averages)
        return "The mean of the last iterations has begun, with which the run ends: its length "
               "stays.";
    if (place.ended_early || options.end_without_gain > 0)
        return "A run with --end-without-gain decides on its length itself.";
    if (options.learn_kernel > 0)
        return "A run that learns its kernel keeps its length, by which the kernel changes.";
    return "";
}

void apply_change(const RunChange& change, TrainOptions& options) {
    if (change.iterations) options.iterations = *change.iterations;
    if (change.max_splats) options.max_splats = *change.max_splats;
    if (change.max_memory_bytes) {
        options.max_memory_bytes = *change.max_memory_bytes;
        if (*change.max_memory_bytes == 0) options.max_memory_bytes.reset();
    }
}

std::string change_text(const TrainOptions& before, const TrainOptions& after) {
    std::string text;
    const auto add = [&](const std::string& what) { text += (text.empty() ? "" : ", ") + what; };
    if (before.iterations != after.iterations)
        add(fmt::format("iterations {} instead of {}", after.iterations, before.iterations));
    const auto splats = [](const TrainOptions& o) {
        return most_text(o.max_splats.value_or(kAnyNumberOfSplats));
    };
    if (before.max_splats != after.max_splats)
        add(fmt::format("at most {} splats instead of {}", splats(after), splats(before)));
    const auto memory = [](const TrainOptions& o) {
        return memory_text(o.max_memory_bytes.value_or(0));
    };
    if (before.max_memory_bytes != after.max_memory_bytes)
        add(fmt::format("device memory of {} instead of {}", memory(after), memory(before)));
    return text;
}

}  // namespace darb
