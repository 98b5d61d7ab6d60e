// SPDX-License-Identifier: MIT
#include "engine/raster/loss.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <thread>

#include "engine/core/error.h"

namespace darb {

namespace {

constexpr int kMinRows = 16;  // px; a strip reads 20 rows more than it owns
// On GPUs a strip reads 64 columns: with 32 lanes 2 a thread, whose state of about 110 floats fits
// the registers. lavapipe keeps it on the stack, where wider strips pay until the cache is full.
constexpr int kGpuStripWidth = 64;
constexpr int kMinCpuColumns = 8, kMaxCpuColumns = 14;

int ceil_divide(int a, int b) {
    return (a + b - 1) / b;
}

// Tiles where one binding holds their maps.
LossWay way_of(const Device& device, int width, int height) {
    const std::uint64_t bytes = std::uint64_t(width) * height * 9 * sizeof(float);
    return bytes <= device.info().max_storage_buffer_bytes ? device.tuning().loss : LossWay::strips;
}

std::uint32_t tiles_of(std::uint32_t pixels) {
    return (pixels + LOSS_TILE - 1) / LOSS_TILE;
}

gpu::LossArgs tiles(int width, int height) {
    gpu::LossArgs args{};
    args.width = static_cast<std::uint32_t>(width);
    args.height = static_cast<std::uint32_t>(height);
    args.works = 3 * tiles_of(args.width) * tiles_of(args.height);
    return args;
}

int cluster_lanes(const Device& device) {
    const std::uint32_t size = device.info().subgroup_size;  // the pipeline has the same
    if (size < 4) {
        throw Error(device.info().name, "its subgroups have fewer than 4 lanes",
                    "training needs subgroup shuffles; choose another device with --device");
    }
    return static_cast<int>(std::min(32u, std::bit_floor(size)));
}

// Columns a thread on a CPU: the fewest columns computed in all for this width of image.
int cpu_columns(int lanes, int width) {
    int best = kMaxCpuColumns, best_cost = std::numeric_limits<int>::max();
    for (int columns = kMaxCpuColumns; columns >= kMinCpuColumns; --columns) {
        const int cost = columns * ceil_divide(width, lanes * columns - 2 * LOSS_HALO);
        if (cost < best_cost) {
            best = columns;
            best_cost = cost;
        }
    }
    return best;
}

int columns_of(const Device& device, int lanes, int max_width, const LossOptions& options) {
    if (options.columns > 0) return options.columns;
    return device.is_lavapipe() ? cpu_columns(lanes, max_width) : kGpuStripWidth / lanes;
}

}  // namespace

Loss::Loss(Device& device, int max_width, int max_height, const LossOptions& options)
    : max_width_(max_width), max_height_(max_height), way_(way_of(device, max_width, max_height)) {
    if (max_width <= 0 || max_height <= 0)
        throw Error("loss", fmt::format("images of {} x {} px", max_width, max_height),
                    "Use at least 1 px each way.");
    const SpecConstants constants = {{"USE_MASK", options.use_mask ? 1 : 0},
                                     {"USE_ALPHA", options.use_alpha ? 1 : 0}};
    if (way_ == LossWay::tiles) {
        maps_ = Pipeline(device, "loss_maps", constants);
        slope_ = Pipeline(device, "loss_gradient", constants);
    } else {
        make_strips(device, options, constants);
    }
    sum_ = Pipeline(device, "loss_sum", {}, false);
    make_buffers(device, *this, buffers(device, max_width, max_height, options), "loss");
}

void Loss::make_strips(Device& device, const LossOptions& options, SpecConstants constants) {
    lanes_ = cluster_lanes(device);
    columns_ = columns_of(device, lanes_, max_width_, options);
    rows_ = options.rows;
    const DeviceInfo& info = device.info();
    if (device.is_lavapipe()) {
        threads_ = static_cast<int>(info.subgroup_size);
        wanted_works_ = 4 * static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    } else {
        threads_ = static_cast<int>(std::max(64u, info.max_subgroup_size));
        wanted_works_ = 4096;
    }
    if (lanes_ * columns_ <= 2 * LOSS_HALO)
        throw Error("loss", fmt::format("{} columns a thread, {} threads", columns_, lanes_),
                    "Use more columns, or 0 for what suits the device.");
    constants["THREADS"] = threads_;
    constants["LANES"] = lanes_;
    constants["COLUMNS"] = columns_;
    loss_ = Pipeline(device, "loss", constants);
}

// The most works that any size up to the largest can be cut into.
BufferList<Loss> Loss::buffers(const Device& device, int max_width, int max_height,
                               const LossOptions& options) {
    const auto partial = [](std::uint64_t works) { return works * sizeof(glm::vec4); };
    if (way_of(device, max_width, max_height) == LossWay::tiles) {
        return {{&Loss::partial_, "loss.partial", partial(tiles(max_width, max_height).works)},
                {&Loss::map_values_, "loss.maps",
                 std::uint64_t(max_width) * max_height * 9 * sizeof(float)}};
    }
    const int lanes = cluster_lanes(device);
    const int columns = columns_of(device, lanes, max_width, options);
    const int strips = ceil_divide(max_width, lanes * columns - 2 * LOSS_HALO);
    const int rows = options.rows > 0 ? options.rows : kMinRows;
    const std::uint64_t works = std::uint64_t{3} * strips * ceil_divide(max_height, rows);
    return {{&Loss::partial_, "loss.partial", partial(works)}};
}

std::uint64_t Loss::device_bytes(const Device& device, int max_width, int max_height,
                                 const LossOptions& options) {
    return charged_bytes(buffers(device, max_width, max_height, options));
}

gpu::LossArgs Loss::strips(int width, int height) const {
    gpu::LossArgs args{};
    args.width = width;
    args.height = height;
    const int across = ceil_divide(width, lanes_ * columns_ - 2 * LOSS_HALO);
    int rows = rows_ > 0 ? rows_ : height;
    while (rows_ == 0 && rows > kMinRows &&
           3 * across * ceil_divide(height, rows) < wanted_works_) {
        rows = std::max(kMinRows, ceil_divide(rows, 2));
    }
    args.rows = rows;
    args.strips = across;
    args.works = 3 * across * ceil_divide(height, rows);
    return args;
}

void Loss::record(Commands& commands, const LossBuffers& buffers, int width, int height,
                  const glm::vec3& background, float lambda) {
    if (width <= 0 || width > max_width_ || height <= 0 || height > max_height_)
        throw Error("loss",
                    fmt::format("an image of {} x {} px, made for {} x {}", width, height,
                                max_width_, max_height_),
                    "Make a Loss for the largest image.");
    const float scale = 1.0f / (3.0f * static_cast<float>(width) * static_cast<float>(height));
    gpu::LossArgs args = way_ == LossWay::tiles ? tiles(width, height) : strips(width, height);
    args.l1_scale = (1.0f - lambda) * scale;
    args.ssim_scale = -lambda * scale;
    args.background_r = background.r;
    args.background_g = background.g;
    args.background_b = background.b;
    commands.pass("loss");
    if (way_ == LossWay::tiles)
        record_tiles(commands, buffers, args);
    else
        record_strips(commands, buffers, args);
    const gpu::LossSumArgs sum_args{args.works, buffers.result_index, scale};
    commands.dispatch(sum_, sum_args, {partial_, buffers.results}, 1);
}

void Loss::record_strips(Commands& commands, const LossBuffers& buffers,
                         const gpu::LossArgs& args) {
    commands.dispatch(loss_, args, {buffers.image, buffers.ground_truth, buffers.d_image, partial_},
                      ceil_divide(static_cast<int>(args.works), threads_ / lanes_));
}

void Loss::record_tiles(Commands& commands, const LossBuffers& buffers, const gpu::LossArgs& args) {
    const std::uint32_t down = tiles_of(args.height), across = args.works / down;
    commands.dispatch(maps_, args, {buffers.image, buffers.ground_truth, map_values_, partial_},
                      across, down);
    commands.dispatch(slope_, args,
                      {buffers.image, buffers.ground_truth, map_values_, buffers.d_image}, across,
                      down);
}

}  // namespace darb
