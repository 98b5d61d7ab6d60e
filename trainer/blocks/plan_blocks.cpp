// How many blocks, and how many splats in each part.
#include <fmt/format.h>

#include <algorithm>

#include "engine/core/error.h"
#include "trainer/blocks/part_options.h"
#include "trainer/blocks/run_blocks.h"
#include "trainer/forecast.h"
#include "trainer/predicted_growth.h"
#include "trainer/memory_plan.h"
#include "trainer/progress.h"

namespace darb {

namespace {

constexpr int kMostBlocks = 1024;
// Of the whole: the coarse model has such a share of the splats, a cell with its margin such a
// multiple of its own share, and a block such a multiple of its share of the photos.
constexpr std::uint32_t kCoarsePart = 8;
constexpr std::uint32_t kFewestCoarse = 1'000;
constexpr double kWithMargin = 1.5, kPhotosOfBlock = 2.5;

}  // namespace

std::uint32_t whole_splats(const Dataset& dataset, const TrainOptions& options) {
    TrainOptions free = options;
    free.max_memory_bytes.reset();
    return options.max_splats ? *options.max_splats : default_budget(dataset, free);
}

std::uint32_t coarse_splats(std::uint32_t whole) {
    return std::min(whole, std::max(whole / kCoarsePart, kFewestCoarse));
}

TrainOptions coarse_options(const Dataset& dataset, const TrainOptions& options) {
    TrainOptions coarse = options;
    coarse.iterations = std::max(1, options.iterations / 2);
    coarse.sh_degree = 0;
    coarse.probe_sh = false;
    coarse.max_splats = coarse_splats(whole_splats(dataset, options));
    return coarse;
}

TrainOptions block_options(const TrainOptions& options, const CellCount& count, std::size_t points,
                           std::uint32_t frozen, std::uint32_t start) {
    TrainOptions block = options;
    block.probe_sh = false;  // what stands around has colours of every degree from the start
    if (!options.max_splats) return block;
    const double share = double(count.with_margin) / double(std::max<std::size_t>(points, 1));
    const auto own = static_cast<std::uint32_t>(share * *options.max_splats);
    block.max_splats = std::max(frozen + own, start);
    return block;
}

Grid blocks_for_memory(Device& device, const Dataset& dataset, const TrainOptions& options,
                       const GroundPlane& plane, std::uint64_t bytes) {
    TrainOptions free = options;
    free.max_memory_bytes.reset();
    free.probe_sh = false;
    const MemoryDemand whole = forecast_training(device, dataset, free, false).peak;
    const double coarse = coarse_splats(whole_splats(dataset, options));
    for (int blocks = 1; blocks <= kMostBlocks; ++blocks) {
        MemoryDemand part = whole;
        const double splats = double(whole.splats) * std::min(1.0, kWithMargin / blocks) + coarse;
        const double photos = std::min(1.0, kPhotosOfBlock / blocks);
        part.splats = static_cast<std::uint64_t>(splats);
        part.intersections =
            static_cast<std::uint64_t>(double(whole.intersections) * splats /
                                       double(std::max<std::uint64_t>(whole.splats, 1)));
        part.photo_pixels = static_cast<std::uint64_t>(photos * double(whole.photo_pixels));
        part.depth_pixels = static_cast<std::uint64_t>(photos * double(whole.depth_pixels));
        part.small_pixels = static_cast<std::uint64_t>(photos * double(whole.small_pixels));
        part.streams = !device.info().unified_memory;
        if (plan_memory(device, part).total() <= bytes)
            return grid_for(blocks, plane, dataset.points.position);
    }
    throw Error("--blocks auto",
                fmt::format("no number of blocks fits {}: each has the {:.0f} splats of the coarse "
                            "model beside its own",
                            format_bytes(double(bytes)), coarse),
                "Raise --max-memory, or use smaller photos (-r) or fewer splats (--cap-max).");
}

std::string blocks_table(const BlocksManifest& m) {
    const std::string bound = m.max_memory > 0 ? " of " + format_bytes(double(m.max_memory)) : "";
    std::string text;
    const auto row = [&](const std::string& name, std::size_t cameras, const PartRecord& part) {
        text += fmt::format(
            "  {:<8} {:>5} cameras, {:>8} splats, {:>7} of them frozen, {:>8} kept; "
            "peak {}{}; {:.1f} s\n",
            name, cameras, part.splats, part.frozen, part.kept,
            format_bytes(double(part.peak_bytes)), bound, part.seconds);
    };
    for (const BlockRecord& block : m.blocks) row(block.name, block.views.size(), block.part);
    return text;
}

}  // namespace darb
