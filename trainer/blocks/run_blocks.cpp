// SPDX-License-Identifier: MIT
#include "trainer/blocks/run_blocks.h"

#include <fmt/format.h>
#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <cstring>
#include <numeric>
#include <optional>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/say.h"
#include "engine/data/camera_list.h"
#include "engine/scene/ply.h"
#include "engine/scene/splat_file.h"
#include "trainer/blocks/block_scene.h"
#include "trainer/blocks/partition.h"
#include "trainer/growth/predicted_growth.h"
#include "trainer/run/forecast.h"
#include "trainer/run/progress.h"
#include "trainer/run/run_folder.h"
#include "trainer/run/run_log.h"
#include "trainer/step/checkpoint.h"
#include "trainer/step/memory_plan.h"

namespace darb {

namespace {

namespace fs = std::filesystem;

constexpr double kCoarseScale = 0.5;        // largest scale of the coarse model's photos
constexpr std::uint64_t kCoarsePhotos = 4;  // 1 / share of the memory that they may take

std::size_t points_in(const BlockRegion& region, const std::vector<double>& points) {
    std::size_t count = 0;
    for (std::size_t p = 0; p < points.size(); p += 3)
        count += region.holds({points[p], points[p + 1], points[p + 2]}) ? 1 : 0;
    return count;
}

class BlocksRun {
  public:
    explicit BlocksRun(const BlocksJob& job)
        : job_(job), folder_(job.run.output / "blocks"), path_(folder_ / "manifest.json") {
        for (std::size_t v = 0; v < job.dataset.views.size(); ++v)
            if (!job.dataset.views[v].is_test) training_.push_back(v);
    }

    BlocksSummary execute(const std::atomic<bool>& stop);

  private:
    void open();
    Grid grid(const GroundPlane& plane) const;
    void train_coarse(const std::atomic<bool>& stop);
    void choose_cameras();
    void train_block(std::size_t cell, const std::atomic<bool>& stop);
    std::vector<bool> done_before(std::size_t cell) const;
    SplatModel final_splats(std::size_t cell) const;
    SplatModel splats_beside(const BlockRegion& region) const;
    void train_round(int round, const std::atomic<bool>& stop);
    bool is_own(std::size_t cell) const {
        return job_.ranks.rank() == static_cast<int>(turn_of(cell)) % job_.ranks.count();
    }
    std::size_t turn_of(std::size_t cell) const;
    bool is_done(int round) const;
    void try_block(std::size_t cell, const std::atomic<bool>& stop);
    void exchange_records();
    void refuse_failed() const;
    void join();
    void train_part(const Dataset& dataset, const TrainOptions& options, RunOptions run,
                    PartRecord& part, const std::atomic<bool>& stop);
    void save() const {
        if (job_.ranks.is_first()) write_manifest(path_, manifest_);
    }
    void note(const std::string& text) const {
        if (!job_.run.quiet) say("{}\n", text);
    }
    Dataset coarse_dataset() const;
    double coarse_scale() const;
    std::vector<std::size_t> views_of(const BlockRecord& block) const;
    const SplatModel& coarse();
    fs::path scene_in(const fs::path& folder, int iterations) const {
        return folder / "point_cloud" / fmt::format("iteration_{}", iterations) / "point_cloud.ply";
    }

    const BlocksJob& job_;
    const fs::path folder_, path_;
    std::vector<std::size_t> training_;  // views
    BlocksManifest manifest_;
    std::vector<CellCount> counts_;
    std::optional<SplatModel> coarse_;
};

Grid BlocksRun::grid(const GroundPlane& plane) const {
    if (job_.asked.columns > 0) return job_.asked;
    const std::unique_ptr<Device> device = job_.device();
    const std::uint64_t bytes =
        job_.options.max_memory_bytes.value_or(usable_bytes(device->info()));
    return blocks_for_memory(*device, job_.dataset, job_.options, plane, bytes);
}

// The cells follow from data set and grid; the rest is what the manifest says, or new.
void BlocksRun::open() {
    const PointCloud& points = job_.dataset.points;
    if (points.size() == 0)
        throw Error(job_.dataset.root.string(), "has no points to divide the ground by",
                    "Leave --blocks out, or give the data set points, as COLMAP finds them.");
    const GroundPlane plane = ground_plane(job_.dataset.views, points.position);
    manifest_.settings = settings_text(job_.options);
    manifest_.dataset = dataset_fingerprint(job_.dataset, {});
    Grid grid;
    if (job_.resume) {
        BlocksManifest before = read_manifest(path_);
        check_manifest(before, path_, manifest_, job_.asked);
        grid = {before.cells.columns, before.cells.rows};
        manifest_ = std::move(before);
    } else {
        grid = this->grid(plane);
        manifest_.coarse_scale = coarse_scale();
    }
    if (grid.columns * grid.rows == 1 && !job_.resume)
        note("blocks: one holds it all; without --blocks the run takes less time");
    manifest_.cells = partition(plane, points.position, grid.columns, grid.rows);
    manifest_.max_memory = job_.options.max_memory_bytes.value_or(0);
    counts_ = count_points(manifest_.cells, points.position);
    manifest_.blocks.resize(manifest_.cells.cells.size());
    for (std::size_t c = 0; c < manifest_.blocks.size(); ++c) {
        manifest_.blocks[c].name = block_name(manifest_.cells, c);
        manifest_.blocks[c].points = counts_[c].own;
    }
    if (!job_.ranks.is_first()) return;
    if (!job_.resume) set_aside(job_.run.output);
    write_camera_list(job_.run.output / "cameras.json", job_.dataset.views);
    write_file_atomic(job_.run.output / "cfg_args",
                      cfg_args(job_.dataset, job_.options, job_.run.output));
    if (!job_.run.request.empty())
        write_file_atomic(job_.run.output / "request.json", job_.run.request);
    save();  // the last: where it is, a run can be resumed
}

// All training views, at half their sides or less: their pixels take a part of the memory.
Dataset BlocksRun::coarse_dataset() const {
    Dataset dataset = block_dataset(job_.dataset, training_);
    dataset.views = scaled_views(dataset.views, manifest_.coarse_scale);
    return dataset;
}

double BlocksRun::coarse_scale() const {
    if (!job_.options.max_memory_bytes) return kCoarseScale;
    double bytes = 0;
    for (const std::size_t v : training_) {
        const Camera& camera = job_.dataset.views[v].camera;
        bytes += 4.0 * camera.width * camera.height;
    }
    const std::uint64_t photo_bytes = *job_.options.max_memory_bytes / kCoarsePhotos;
    return std::min(kCoarseScale, std::sqrt(static_cast<double>(photo_bytes) / bytes));
}

// Goes on from the part's own checkpoint, where there is one.
void BlocksRun::train_part(const Dataset& dataset, const TrainOptions& options, RunOptions run,
                           PartRecord& part, const std::atomic<bool>& stop) {
    run.test_iterations = run.save_iterations = run.checkpoint_iterations = {};
    run.request.clear();
    run.checkpoint_interval = job_.run.checkpoint_interval;
    run.quiet = job_.run.quiet;
    run.report = job_.run.report;
    run.effects = job_.run.effects;
    run.effects_json = job_.run.effects_json;
    if (const fs::path own = run.output / "checkpoint.darb"; fs::exists(own)) run.resume_from = own;
    part.state = PartState::training;
    part.error.clear();
    save();
    const std::unique_ptr<Device> device = job_.device();
    const TrainResult summary = run_training(*device, dataset, options, run, &stop);
    part.peak_bytes = std::max(part.peak_bytes, device->peak_bytes());
    part.seconds = summary.seconds;
    if (!summary.interrupted) part.state = PartState::done;
}

void BlocksRun::train_coarse(const std::atomic<bool>& stop) {
    PartRecord& part = manifest_.coarse;
    const TrainOptions options = coarse_options(job_.dataset, job_.options);
    if (part.state != PartState::done) {
        const Dataset dataset = coarse_dataset();
        const Camera& first = dataset.views.front().camera;
        note(
            fmt::format("blocks: {}x{}; first a coarse model, {} photos of {} x {} px, up to {} "
                        "splats",
                        manifest_.cells.columns, manifest_.cells.rows, dataset.views.size(),
                        first.width, first.height, *options.max_splats));
        RunOptions run;
        run.output = folder_ / "coarse";
        train_part(dataset, options, run, part, stop);
        if (part.state == PartState::done)
            part.splats = part.kept = static_cast<std::uint32_t>(coarse().size());
        save();
    }
    if (part.state == PartState::done) choose_cameras();
}

const SplatModel& BlocksRun::coarse() {
    if (!coarse_) {
        const int iterations = coarse_options(job_.dataset, job_.options).iterations;
        coarse_ = load_splats(scene_in(folder_ / "coarse", iterations));
    }
    return *coarse_;
}

void BlocksRun::choose_cameras() {
    std::vector<BlockRecord>& blocks = manifest_.blocks;
    if (std::any_of(blocks.begin(), blocks.end(),
                    [](const BlockRecord& block) { return block.views.empty(); })) {
        const Dataset dataset = coarse_dataset();
        const std::unique_ptr<Device> device = job_.device();
        ProjectionEffects effects = job_.options.projection;
        effects.antialias = coarse().antialias;
        const auto chosen =
            choose_views(cell_shares(*device, coarse(), manifest_.cells, dataset.views, effects));
        for (std::size_t c = 0; c < blocks.size(); ++c) blocks[c].views = chosen[c];
    }
    for (const BlockRecord& block : blocks)
        if (block.views.size() < kFewestViews)
            throw Error("block " + block.name,
                        fmt::format("{} cameras see its cell; it takes {}", block.views.size(),
                                    kFewestViews),
                        "Use fewer blocks, by a number after --blocks.");
    save();
}

std::vector<std::size_t> BlocksRun::views_of(const BlockRecord& block) const {
    std::vector<std::size_t> views;
    for (const std::size_t v : block.views) {
        if (v >= training_.size())
            throw Error(path_.string(),
                        fmt::format("block {} has the training view {} of {}", block.name, v,
                                    training_.size()),
                        "Start without --resume.");
        views.push_back(training_[v]);
    }
    return views;
}

// Those of earlier rounds: which they are depends on no order within a round.
std::vector<bool> BlocksRun::done_before(std::size_t cell) const {
    std::vector<bool> done;
    for (std::size_t c = 0; c < manifest_.blocks.size(); ++c)
        done.push_back(manifest_.cells.round_of(c) < manifest_.cells.round_of(cell));
    return done;
}

SplatModel BlocksRun::final_splats(std::size_t cell) const {
    const BlockRecord& block = manifest_.blocks[cell];
    return cut_to_cell(load_splats(scene_in(folder_ / block.name, job_.options.iterations)),
                       block.part.frozen, manifest_.cells, cell);
}

// Splats of finished cells that lie in the margin of this one; empty where there are none.
SplatModel BlocksRun::splats_beside(const BlockRegion& region) const {
    const Cell& own = manifest_.cells.cells[region.cell];
    std::vector<SplatModel> parts;
    for (std::size_t c = 0; c < region.done.size(); ++c) {
        const Cell& other = manifest_.cells.cells[c];
        const glm::dvec2 low = own.low - own.margin, high = own.high + own.margin;
        if (region.done[c] && other.low.x < high.x && other.high.x > low.x &&
            other.low.y < high.y && other.high.y > low.y)
            parts.push_back(cut_to_margin(final_splats(c), own, manifest_.cells.plane));
    }
    return parts.empty() ? SplatModel{} : join_parts(parts);
}

void BlocksRun::train_block(std::size_t cell, const std::atomic<bool>& stop) {
    BlockRecord& block = manifest_.blocks[cell];
    const Dataset dataset = block_dataset(job_.dataset, views_of(block));
    const BlockRegion region{manifest_.cells, cell, done_before(cell)};
    BlockStart start =
        block_start(coarse(), region, splats_beside(region), dataset.views, job_.options.sh_degree);
    CellCount count = counts_[cell];
    count.with_margin = points_in(region, job_.dataset.points.position);
    const TrainOptions options =
        block_options(job_.options, count, job_.dataset.points.size(), start.frozen,
                      static_cast<std::uint32_t>(start.model.size()));
    add_points(job_.dataset, region, job_.options, options.max_splats.value_or(kAnyNumberOfSplats),
               start);
    const auto splats = static_cast<std::uint32_t>(start.model.size());
    block.part.frozen = start.frozen;
    note(fmt::format("block {}: {} photos, {} splats to begin with and {} frozen around them",
                     block.name, dataset.views.size(), splats - start.frozen, start.frozen));
    RunOptions run;
    run.output = folder_ / block.name;
    run.start = &start.model;
    run.frozen = start.frozen;
    train_part(dataset, options, run, block.part, stop);
    if (block.part.state != PartState::done) return;
    const SplatModel trained = load_splats(scene_in(run.output, options.iterations));
    block.part.splats = static_cast<std::uint32_t>(trained.size());
    block.part.kept = static_cast<std::uint32_t>(
        cut_to_cell(trained, start.frozen, manifest_.cells, cell).size());
}

// A block that fails leaves the others of its round to go on; where not even that can be written,
// all ends.
void BlocksRun::try_block(std::size_t cell, const std::atomic<bool>& stop) {
    PartRecord& part = manifest_.blocks[cell].part;
    try {
        train_block(cell, stop);
    } catch (const std::exception& e) {
        part.state = PartState::failed;
        part.error = e.what();
        say("block {} failed: {}\n", manifest_.blocks[cell].name, e.what());
    }
    save();
}

// Among the cells of its round.
std::size_t BlocksRun::turn_of(std::size_t cell) const {
    std::size_t turn = 0;
    for (std::size_t c = 0; c < cell; ++c)
        turn += manifest_.cells.round_of(c) == manifest_.cells.round_of(cell) ? 1 : 0;
    return turn;
}

bool BlocksRun::is_done(int round) const {
    for (std::size_t c = 0; c < manifest_.blocks.size(); ++c)
        if (manifest_.cells.round_of(c) == round &&
            manifest_.blocks[c].part.state != PartState::done)
            return false;
    return true;
}

void BlocksRun::train_round(int round, const std::atomic<bool>& stop) {
    for (std::size_t c = 0; c < manifest_.blocks.size(); ++c)
        if (manifest_.cells.round_of(c) == round && is_own(c) &&
            manifest_.blocks[c].part.state != PartState::done && !stop)
            try_block(c, stop);
    exchange_records();
}

// What each rank did goes to all.
void BlocksRun::exchange_records() {
    if (job_.ranks.count() == 1) return;
    std::string own;
    for (std::size_t c = 0; c < manifest_.blocks.size(); ++c)
        if (is_own(c)) {
            const PartRecord& p = manifest_.blocks[c].part;
            own += fmt::format("{} {} {} {} {} {} {}", int(p.state), p.frozen, p.splats, p.kept,
                               p.peak_bytes, p.seconds, p.error);
            own += '\0';
        }
    const std::vector<Bytes> all = job_.ranks.gather(std::as_bytes(std::span(own)));
    std::vector<std::size_t> at(all.size());
    for (std::size_t c = 0; c < manifest_.blocks.size(); ++c) {
        const std::size_t rank = turn_of(c) % all.size();
        const char* text = reinterpret_cast<const char*>(all[rank].data()) + at[rank];
        at[rank] += std::strlen(text) + 1;
        PartRecord p;
        int state = 0, read = 0;
        std::sscanf(text, "%d %u %u %u %" SCNu64 " %lf %n", &state, &p.frozen, &p.splats, &p.kept,
                    &p.peak_bytes, &p.seconds, &read);
        p.state = static_cast<PartState>(state);
        p.error = text + read;
        manifest_.blocks[c].part = std::move(p);
    }
    save();
}

void BlocksRun::refuse_failed() const {
    std::string failed;
    for (const BlockRecord& block : manifest_.blocks)
        if (block.part.state == PartState::failed)
            failed += fmt::format("\n  block {}: {}", block.name, block.part.error);
    if (!failed.empty())
        throw Error(job_.run.output.string(),
                    "blocks failed, and what comes after them waits:" + failed,
                    fmt::format("darb train --resume -o '{}' tries these again and goes on.",
                                job_.run.output.string()));
}

void BlocksRun::join() {
    std::vector<SplatModel> parts;
    for (std::size_t c = 0; c < manifest_.blocks.size(); ++c) parts.push_back(final_splats(c));
    const SplatModel joined = join_parts(parts);
    write_ply(scene_in(job_.run.output, job_.options.iterations), joined);
    manifest_.joined = static_cast<std::uint32_t>(joined.size());
    save();
    try {  // one device draws all of it, which may be more than it holds: the scene is there anyway
        const Evaluation evaluation = job_.evaluate(joined);
        manifest_.held_out = evaluation.views.size();
        manifest_.psnr_db = evaluation.psnr_db;
        manifest_.ssim = evaluation.ssim;
        save();
    } catch (const std::exception& e) {
        say("the joined scene was not measured: {}\n", e.what());
    }
}

BlocksSummary BlocksRun::execute(const std::atomic<bool>& stop) {
    Ranks& ranks = job_.ranks;
    if (ranks.is_first()) {
        open();
        train_coarse(stop);
    }
    ranks.gather({});  // the manifest has the cameras
    if (!ranks.is_first()) {
        BlocksJob again = job_;
        again.resume = true;
        BlocksRun as_written(again);
        as_written.open();
        manifest_ = std::move(as_written.manifest_);
        counts_ = std::move(as_written.counts_);
    }
    for (BlockRecord& block : manifest_.blocks)  // they are tried again
        if (block.part.state == PartState::failed) block.part.state = PartState::waiting;
    const bool begins = manifest_.coarse.state == PartState::done;
    for (int round = 0; begins && round < Partition::kRounds; ++round) {
        train_round(round, stop);
        if (!is_done(round)) break;  // the next ones need all of these beside them
    }
    bool done = begins, failed = false;
    for (const BlockRecord& block : manifest_.blocks) {
        done = done && block.part.state == PartState::done;
        failed = failed || block.part.state == PartState::failed;
    }
    BlocksSummary summary;
    summary.interrupted = !done && !failed;
    if (ranks.is_first() && !summary.interrupted) {
        refuse_failed();
        join();
        summary.scene = scene_in(job_.run.output, job_.options.iterations);
    }
    summary.manifest = manifest_;
    return summary;
}

}  // namespace

BlocksSummary run_blocks(const BlocksJob& job, const std::atomic<bool>& stop) {
    return BlocksRun(job).execute(stop);
}

// How many blocks, and how many splats in each part.

namespace {

constexpr int kMostBlocks = 1024;
// The coarse model has 1 / kCoarsePart of the scene's splats. A cell with its margin is taken to
// have kWithMargin times its share of the splats, and a block kPhotosOfBlock times its share of the
// photos.
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
    block.probe_sh = false;  // the surroundings have colours of every degree from the start
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
